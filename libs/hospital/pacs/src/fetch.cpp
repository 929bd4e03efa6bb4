#include "osteo/hospital/pacs/fetch.h"

#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <set>
#include <span>

#include "node_tables.h"
#include "query.h"

namespace osteo::inline hospital {
namespace {

using pacs::text_of;

constexpr std::size_t kMaxFetchedSeries = 10'000;

int number_of(const std::string& text, int otherwise) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  int value = otherwise;
  std::from_chars(text.data() + begin, text.data() + text.size(), value);
  return value;
}

// Takes objects as they come, each into a file of its own, and counts.
class Getter : public pacs::Scu {
 public:
  Getter(fs::path folder, const FetchLimits& limits, int expected, const Context& context)
      : folder_(std::move(folder)), limits_(limits), expected_(expected), context_(context) {}
  FetchReport got;
  std::string problem;
  bool resources = false;
  unsigned status = 0xFFFF;
  int failed = 0;
  std::set<std::string> instances;

 private:
  OFCondition handleSTORERequestFile(T_ASC_PresentationContextID* id, const OFString&,
                                     T_DIMSE_C_StoreRQ* request) override {
    char name[24];
    std::snprintf(name, sizeof name, "%06d.dcm", got.images + 1);
    const fs::path file = folder_ / name;
    bytes_ = 0;
    const OFCondition done = DcmSCU::handleSTORERequestFile(id, file.c_str(), request);
    if (done.bad()) {
      problem = std::string("an object could not be stored: ") + done.text();
      return done;
    }
    std::error_code error;
    const auto space = fs::space(folder_, error);
    if (!pacs::holds_data_set(file, bytes_)) {
      problem = "an object was cut short on its way to the disk";
      resources = !error && static_cast<double>(space.available) < limits_.keep_free_gb * 1e9;
      return EC_InvalidStream;
    }
    got.bytes += bytes_;
    ++got.images;
    instances.insert(request->AffectedSOPInstanceUID);
    resources = static_cast<double>(got.bytes) > limits_.series_gb * 1e9 ||
                (!error && static_cast<double>(space.available) < limits_.keep_free_gb * 1e9);
    if (resources)
      problem = static_cast<double>(got.bytes) > limits_.series_gb * 1e9 ? "the series is larger than allowed"
                                                                         : "the disk is nearly full";
    if (expected_ > 0) context_.progress(std::min(1.0, static_cast<double>(got.images) / expected_), "fetching");
    return resources || context_.cancelled() ? EC_InvalidStream : EC_Normal;
  }
  OFCondition handleCGETResponse(T_ASC_PresentationContextID, RetrieveResponse* response, OFBool& go_on) override {
    status = response->m_status;
    failed = std::max<int>(failed, response->m_numberOfFailedSubops);
    go_on = DICOM_PENDING_STATUS(status) ? OFTrue : OFFalse;
    return EC_Normal;
  }
  void notifyRECEIVEProgress(unsigned long bytes) override { bytes_ = bytes; }

  fs::path folder_;
  FetchLimits limits_;
  int expected_;
  Context context_;
  std::uint64_t bytes_ = 0;
};

// No file of this process may grow beyond it while this lives; writing more fails in place of ending the process.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(double bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    rlimit now = old_;
    now.rlim_cur = std::min(old_.rlim_max, static_cast<rlim_t>(bytes));
    setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  void (*handler_)(int);
  rlimit old_{};
};

}  // namespace

bool pacs::before(const RemoteSeries& a, const RemoteSeries& b) {
  return std::tie(a.study, a.number, a.series) < std::tie(b.study, b.number, b.series);
}

void pacs::check_keys(const SeriesKeys& keys) {
  if (keys.study.empty() && keys.series.empty() && keys.accession.empty() && keys.patient_id.empty() &&
      keys.study_date.empty())
    throw Error(ExitCode::usage, "say what to look for: a whole archive is not listed",
                "--study, --series, --accession, --patient-id or --date");
  for (const std::string& uid : {keys.study, keys.series})
    if (!uid.empty() && !pacs::is_uid(uid))
      throw Error(ExitCode::usage, "'" + uid + "' is no UID", "digits and dots, at most 64");
  for (const std::string& text : {keys.accession, keys.patient_id, keys.study_date, keys.modality})
    if (text.size() > 64 || text.find_first_of("\\*?") != std::string::npos)
      throw Error(ExitCode::usage, "'" + text + "' cannot be looked for", "at most 64 characters, without \\, * and ?");
}

std::vector<RemoteSeries> find_series(const DicomPeer& peer, const SeriesKeys& keys, const Context& context) {
  pacs::check_keys(keys);
  pacs::warn_of_open_key(peer.tls, context);
  pacs::Query query(peer);
  // Studies first: the study root asks for series of one study at a time (PS3.4 C.6.2).
  DcmDataset studies;
  studies.putAndInsertString(DCM_QueryRetrieveLevel, "STUDY");
  studies.putAndInsertString(DCM_StudyInstanceUID, keys.study.c_str());
  studies.putAndInsertString(DCM_StudyDate, keys.study_date.c_str());
  studies.putAndInsertString(DCM_AccessionNumber, keys.accession.c_str());
  studies.putAndInsertString(DCM_PatientID, keys.patient_id.c_str());
  std::vector<RemoteSeries> all;
  const bool by_series_alone =
      keys.study.empty() && keys.accession.empty() && keys.patient_id.empty() && keys.study_date.empty();
  std::vector<std::pair<std::string, std::string>> of;
  if (by_series_alone) {
    of.emplace_back("", "");  // many nodes answer all the same
  } else {
    for (const auto& study : query.ask(studies, kMaxFetchedSeries))
      of.emplace_back(text_of(*study, DCM_StudyInstanceUID), text_of(*study, DCM_StudyDate));
  }
  for (const auto& [uid, date] : of) {
    context.check_cancelled();
    DcmDataset q;
    q.putAndInsertString(DCM_QueryRetrieveLevel, "SERIES");
    q.putAndInsertString(DCM_StudyInstanceUID, uid.c_str());
    q.putAndInsertString(DCM_SeriesInstanceUID, keys.series.c_str());
    q.putAndInsertString(DCM_Modality, keys.modality.c_str());
    q.putAndInsertString(DCM_SeriesNumber, "");
    q.putAndInsertString(DCM_SeriesDescription, "");
    q.putAndInsertString(DCM_NumberOfSeriesRelatedInstances, "");
    for (const auto& s : query.ask(q, kMaxFetchedSeries)) {
      RemoteSeries r{text_of(*s, DCM_StudyInstanceUID),
                     text_of(*s, DCM_SeriesInstanceUID),
                     text_of(*s, DCM_Modality),
                     text_of(*s, DCM_SeriesDescription),
                     date,
                     number_of(text_of(*s, DCM_SeriesNumber), 0),
                     number_of(text_of(*s, DCM_NumberOfSeriesRelatedInstances), -1)};
      if (pacs::is_uid(r.study) && pacs::is_uid(r.series)) all.push_back(std::move(r));
    }
  }
  std::ranges::sort(all, pacs::before);
  return all;
}

FetchReport fetch_series(const DicomPeer& peer, const RemoteSeries& series, const fs::path& folder,
                         const FetchLimits& limits, const Context& context) {
  if (!fs::is_directory(folder) || !fs::is_empty(folder))
    throw Error(ExitCode::cannot_write, folder.string() + " is no empty folder");
  Getter scu(folder, limits, series.images, context);
  scu.prepare(peer);
  scu.setStorageMode(DCMSCU_STORAGE_BIT_PRESERVING);
  OFList<OFString> plain;
  for (const pacs::UidRow& row : pacs::kPlainSyntaxes) plain.push_back(row.uid.data());
  scu.addPresentationContext(pacs::kGetStudyRoot.uid.data(), plain);
  const auto take = [&](const pacs::UidRow& sop_class, std::span<const pacs::UidRow> forms) {
    for (const pacs::UidRow& form : forms) {
      OFList<OFString> one;
      one.push_back(form.uid.data());
      scu.addPresentationContext(sop_class.uid.data(), one, ASC_SC_ROLE_SCP);
    }
  };
  for (const pacs::UidRow& row : pacs::kFetchedImages) take(row, pacs::kFetchedForms);
  for (const pacs::UidRow& row : pacs::kFetchedObjects)
    take(row, std::span(pacs::kFetchedForms).first(pacs::kPlainForms));
  scu.connect(peer);
  DcmDataset keys;
  keys.putAndInsertString(DCM_QueryRetrieveLevel, "SERIES");
  keys.putAndInsertString(DCM_StudyInstanceUID, series.study.c_str());
  keys.putAndInsertString(DCM_SeriesInstanceUID, series.series.c_str());
  const auto id = scu.findPresentationContextID(pacs::kGetStudyRoot.uid.data(), "");
  if (id == 0)
    throw Error(ExitCode::failed, peer_text(peer) + " does not give by C-GET",
                "let it send to 'osteo receive' instead, or allow C-GET for " + peer.own_ae);
  OFCondition done;
  {
    const FileSizeLimit limit(limits.object_gb * 1e9);
    done = scu.sendCGETRequest(id, &keys, nullptr);
  }
  context.check_cancelled();
  if (!scu.problem.empty()) throw Error(scu.resources ? ExitCode::resources : ExitCode::cannot_write, scu.problem);
  if (done.bad()) throw Error(ExitCode::failed, peer_text(peer) + " did not give the series: " + done.text());
  scu.releaseAssociation();
  if (scu.failed > 0)
    throw Error(ExitCode::failed,
                peer_text(peer) + " says that " + std::to_string(scu.failed) + " objects could not be sent",
                "perhaps in a form that is not taken here");
  if (scu.status != STATUS_Success)
    throw Error(ExitCode::failed, peer_text(peer) + ": " + pacs::status_text(scu.status));
  if (scu.got.images == 0) throw Error(ExitCode::no_input, peer_text(peer) + " has nothing of this series");
  if (series.images >= 0 && static_cast<int>(scu.instances.size()) != series.images)
    throw Error(ExitCode::failed,
                "there are " + std::to_string(series.images) + " objects in the series, and " +
                    std::to_string(scu.instances.size()) + " came",
                "more may have arrived meanwhile: ask again");
  return scu.got;
}

}  // namespace osteo::inline hospital
