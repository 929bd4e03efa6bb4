#include "osteo/hospital/pacs/send.h"

#include <algorithm>
#include <map>
#include <set>

#include "query.h"

namespace osteo::inline hospital {
namespace {

using pacs::text_of;

constexpr std::size_t kMaxContexts = 120;         // of 128 that an association has
constexpr std::size_t kMaxInstances = 1'000'000;  // of a series: a node may answer without end

OFList<OFString> syntax_list(const std::string& syntax) {
  OFList<OFString> list;
  list.push_back(syntax.c_str());
  return list;
}

std::string check(const DicomPeer& peer, SendReport& report, const Context& context) {
  std::map<std::pair<std::string, std::string>, std::vector<SentObject*>> series;
  for (SentObject& s : report.objects)
    if (s.accepted) series[{s.object.study, s.object.series}].push_back(&s);
  if (series.empty()) return "nothing was accepted";
  try {
    pacs::Query query(peer);
    for (auto& [uids, objects] : series) {
      context.check_cancelled();
      DcmDataset keys;
      keys.putAndInsertString(DCM_QueryRetrieveLevel, "IMAGE");
      keys.putAndInsertString(DCM_StudyInstanceUID, uids.first.c_str());
      keys.putAndInsertString(DCM_SeriesInstanceUID, uids.second.c_str());
      keys.putAndInsertString(DCM_SOPInstanceUID, "");
      std::set<std::string> have;
      for (const auto& answer : query.ask(keys, kMaxInstances)) have.insert(text_of(*answer, DCM_SOPInstanceUID));
      for (SentObject* const s : objects) s->found = have.contains(s->object.sop_instance);
    }
  } catch (const Error& e) {
    if (e.code() == ExitCode::cancelled) throw;
    return e.what();
  }
  return {};
}

}  // namespace

std::size_t SendReport::accepted() const {
  return static_cast<std::size_t>(std::ranges::count_if(objects, [](const SentObject& s) { return s.accepted; }));
}

std::size_t SendReport::safe() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(objects, [](const SentObject& s) { return s.accepted && s.found.value_or(true); }));
}

DicomObjects list_objects(const std::vector<fs::path>& sources, const Context& context) {
  pacs::quiet_dcmtk(1);
  std::vector<fs::path> files;
  for (const fs::path& source : sources) {
    require_readable(source);
    if (!fs::is_directory(source)) {
      files.push_back(source);
      continue;
    }
    try {
      for (const auto& entry : fs::recursive_directory_iterator(source))
        if (entry.is_regular_file()) files.push_back(entry.path());
    } catch (const fs::filesystem_error& e) {
      throw error_of(e);
    }
  }
  std::ranges::sort(files);
  files.erase(std::unique(files.begin(), files.end()), files.end());
  DicomObjects found;
  for (std::size_t n = 0; n < files.size(); ++n) {
    context.progress(static_cast<double>(n) / static_cast<double>(files.size()), "reading heads");
    pacs::ObjectHead head;
    // A DICOMDIR is a list of files on a disk: of no use to a node.
    if (!pacs::read_head(files[n], head) || head.sop_class == UID_MediaStorageDirectoryStorage) {
      found.set_aside.push_back(files[n]);
      continue;
    }
    found.objects.push_back({files[n], fs::file_size(files[n]), pacs::class_name(head.sop_class), head.sop_class,
                             head.sop_instance, head.study, head.series, head.syntax});
  }
  if (found.objects.empty()) throw Error(ExitCode::no_input, "there is no DICOM object in what is given");
  return found;
}

SendReport send_objects(const DicomPeer& peer, const std::vector<DicomObject>& objects, bool check_after,
                        const Context& context) {
  pacs::warn_of_open_key(peer.tls, context);
  SendReport report;
  std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> by_context;
  for (const DicomObject& o : objects) {
    by_context[{o.sop_class, o.syntax}].push_back(report.objects.size());
    report.objects.push_back({o, false, {}, {}});
  }
  std::size_t done = 0;
  for (auto first = by_context.begin(); first != by_context.end();) {
    auto last = first;
    pacs::Scu scu;
    scu.prepare(peer);
    for (std::size_t n = 0; n < kMaxContexts && last != by_context.end(); ++n, ++last)
      scu.addPresentationContext(last->first.first.c_str(), syntax_list(last->first.second));
    scu.connect(peer);
    for (; first != last; ++first) {
      const auto& [sop_class, syntax] = first->first;
      const auto id = scu.findPresentationContextID(sop_class.c_str(), syntax.c_str());
      for (const std::size_t n : first->second) {
        context.progress(static_cast<double>(done++) / static_cast<double>(objects.size()), "sending");
        SentObject& s = report.objects[n];
        if (id == 0) {
          s.problem = "the node does not take " + s.object.kind + " in the form '" +
                      DcmXfer(syntax.c_str()).getXferName() + "'";
          continue;
        }
        Uint16 status = 0;
        const OFCondition sent = scu.sendSTORERequest(id, s.object.file.c_str(), nullptr, status);
        if (sent.bad()) {
          s.problem = sent.text();
          if (!scu.isConnected()) {  // the next one may still pass
            scu.closeAssociation(DCMSCU_ABORT_ASSOCIATION);
            scu.connect(peer);
          }
          continue;
        }
        s.accepted = status == STATUS_Success || DICOM_WARNING_STATUS(status);
        if (status != STATUS_Success) s.problem = pacs::status_text(status);
      }
    }
    scu.releaseAssociation();
  }
  report.not_checked = check_after ? check(peer, report, context) : "not asked for";
  return report;
}

}  // namespace osteo::inline hospital
