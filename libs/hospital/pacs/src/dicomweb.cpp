#include "osteo/hospital/pacs/dicomweb.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include "http.h"
#include "multipart.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/batch/children.h"
#include "query.h"

namespace osteo::inline hospital {
namespace {

constexpr std::size_t kMaxText = 8'000'000;  // bytes of an answer in JSON
constexpr std::size_t kPage = 500;           // matches that are asked for at once
constexpr std::size_t kMaxPages = 2'000;     // a server may always give one more
constexpr std::size_t kMaxSeries = 10'000;
constexpr std::size_t kMaxInstances = 1'000'000;
constexpr std::uint64_t kBatchBytes = 32'000'000;
constexpr std::size_t kBatchObjects = 100;
constexpr ChildLimits kReader{1000, 3600};  // of the process that reads what came

// Attributes as the DICOM JSON model calls them (PS3.18 F).
constexpr const char* kStudyDate = "00080020";
constexpr const char* kAccession = "00080050";
constexpr const char* kModality = "00080060";
constexpr const char* kSeriesDescription = "0008103E";
constexpr const char* kReferencedInstance = "00081155";
constexpr const char* kWarningReason = "00081196";
constexpr const char* kFailureReason = "00081197";
constexpr const char* kFailed = "00081198";
constexpr const char* kStored = "00081199";
constexpr const char* kPatientId = "00100020";
constexpr const char* kInstance = "00080018";
constexpr const char* kStudy = "0020000D";
constexpr const char* kSeries = "0020000E";
constexpr const char* kSeriesNumber = "00200011";
constexpr const char* kImages = "00201209";

const Json::List& values_of(const Json& object, const char* attribute) {
  static const Json::List none;
  const Json* const element = object.find(attribute);
  const Json* const values = element == nullptr ? nullptr : element->find("Value");
  return values == nullptr ? none : values->items();
}

// The first value; numbers as text, as some servers write them.
std::string text_in(const Json& object, const char* attribute) {
  const Json::List& values = values_of(object, attribute);
  if (values.empty()) return {};
  std::string text;
  if (values[0].text() != nullptr)
    text = *values[0].text();
  else if (values[0].number())
    text = values[0].dump();
  while (text.ends_with(' ') || text.ends_with('\0')) text.pop_back();
  return text;
}

int number_in(const Json& object, const char* attribute, int otherwise) {
  const std::string text = text_in(object, attribute);
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  int value = otherwise;
  std::from_chars(text.data() + begin, text.data() + text.size(), value);
  return value;
}

// Everything but what RFC 3986 calls unreserved, and slash and colon, which it lets stand in a query: Orthanc's
// plugin 1.7 takes what is written with % as it is written.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if ((c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' || c == '.' ||
        c == '_' || c == '~' || c == '/' || c == ':') {
      out += c;
    } else {
      char hex[4];
      std::snprintf(hex, sizeof hex, "%%%02X", static_cast<unsigned char>(c));
      out += hex;
    }
  }
  return out;
}

// Servers may compare without regard to case.
bool alike(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

class Web {
 public:
  Web(const WebServer& server, const Context& context) : context_(context), http_(server, context) {}

  /// Calls `take` for each match of QIDO-RS, page by page until nothing new comes: a server may give fewer at a time
  /// than it is asked for. `identity` is the attribute that tells one from another. `keys` begins with '?'.
  void query(const std::string& path, const std::string& keys, const char* identity, std::size_t most,
             const std::function<void(const Json&, const std::string& uid)>& take) {
    std::set<std::string> seen;
    for (std::size_t offset = 0, page = 0;; ++page) {
      if (page == kMaxPages)
        throw http_.wrong("does not come to the end of a list", "ask for less: a date, a modality, a study");
      const pacs::Reply reply =
          http_.ask({.path = path + keys + "limit=" + std::to_string(kPage) + "&offset=" + std::to_string(offset),
                     .accept = "application/dicom+json",
                     .most = kMaxText});
      if (reply.status == 204) return;
      if (reply.status != 200)
        throw http_.wrong("answers with status " + std::to_string(reply.status),
                          "is it the root of a DICOMweb server?");
      const auto list = Json::parse(reply.text);
      if (!list || reply.text.find_first_not_of(" \r\n\t") != reply.text.find('['))
        throw http_.wrong("gives an answer that is no list in JSON", "is it the root of a DICOMweb server?");
      const std::size_t before = seen.size();
      for (const Json& match : list->items()) {
        const std::string uid = text_in(match, identity);
        if (!pacs::is_uid(uid)) throw http_.wrong("gives a match without a UID");
        if (!seen.insert(uid).second) continue;
        if (seen.size() > most)
          throw Error(ExitCode::usage, "more than " + std::to_string(most) + " match",
                      "ask for less: a date, a modality, a study");
        take(match, uid);
      }
      if (seen.size() == before) return;
      offset += list->items().size();
    }
  }

  /// UIDs of a series' objects.
  std::set<std::string> instances(const std::string& study, const std::string& series) {
    std::set<std::string> uids;
    query("/studies/" + study + "/series/" + series + "/instances", "?", kInstance, kMaxInstances,
          [&](const Json&, const std::string& uid) { uids.insert(uid); });
    return uids;
  }

  [[nodiscard]] Error strange(const char* what) const {
    return http_.wrong(std::string("answers with a ") + what + " that was not asked for");
  }

  pacs::Http& http() { return http_; }

 private:
  const Context& context_;
  pacs::Http http_;
};

// PS3.10: a preamble of 128 bytes, then "DICM".
bool is_file_of_part_10(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 132> head{};
  return in.read(head.data(), head.size()) && std::string_view(head.data() + 128, 4) == "DICM";
}

// --- sending
// -------------------------------------------------------------------------------------------------------------------------

// The body of a request: heads of parts and files, one after the other.
class Body {
 public:
  explicit Body(std::span<SentObject* const> objects) {
    unsigned char random[16];
    randombytes_buf(random, sizeof random);  // no file can hold it by intent
    boundary_ = "osteo-";
    for (const unsigned char c : random) {
      char hex[3];
      std::snprintf(hex, sizeof hex, "%02x", c);
      boundary_ += hex;
    }
    for (std::size_t n = 0; n < objects.size(); ++n) {
      const DicomObject& o = objects[n]->object;
      pieces_.push_back(
          {(n == 0 ? "--" : "\r\n--") + boundary_ + "\r\nContent-Type: application/dicom\r\n\r\n", {}, 0});
      pieces_.push_back({{}, o.file, o.bytes});
    }
    pieces_.push_back({"\r\n--" + boundary_ + "--\r\n", {}, 0});
    upload_.type = R"(multipart/related; type="application/dicom"; boundary=)" + boundary_;
    for (Piece& p : pieces_) {
      if (p.file.empty()) p.bytes = p.text.size();
      upload_.bytes += p.bytes;
    }
    upload_.read = [this](char* to, std::size_t n) { return read(to, n); };
    upload_.again = [this] {
      piece_ = 0;
      at_ = 0;
    };
  }
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;
  [[nodiscard]] const pacs::Upload& upload() const { return upload_; }

 private:
  struct Piece {
    std::string text;
    fs::path file;
    std::uint64_t bytes = 0;
  };

  std::size_t read(char* to, std::size_t n) {
    while (piece_ < pieces_.size() && at_ == pieces_[piece_].bytes) {
      ++piece_;
      at_ = 0;
    }
    if (piece_ == pieces_.size()) return 0;
    const Piece& p = pieces_[piece_];
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(n, p.bytes - at_));
    if (p.file.empty()) {
      std::memcpy(to, p.text.data() + at_, count);
    } else {
      if (at_ == 0) {
        file_.close();
        file_.clear();
        file_.open(p.file, std::ios::binary);
      }
      if (!file_.read(to, static_cast<std::streamsize>(count)))
        throw Error(ExitCode::cannot_read, "'" + p.file.string() + "' became shorter while it was sent");
    }
    at_ += count;
    return count;
  }

  std::string boundary_;
  std::vector<Piece> pieces_;
  std::size_t piece_ = 0;
  std::uint64_t at_ = 0;
  std::ifstream file_;
  pacs::Upload upload_;
};

std::string reason_text(const Json& item, const char* attribute) {
  const int reason = number_in(item, attribute, -1);
  if (reason < 0 || reason > 0xFFFF) return "it rejected it, and does not say why";
  return reason == 0xC122 ? "it does not take this transfer syntax (status C122)"
                          : pacs::status_text(static_cast<unsigned>(reason));
}

std::string status_words(long status) {
  const std::string code = " (status " + std::to_string(status) + ")";
  switch (status) {
    case 400:
      return "the server finds the request wrong" + code;
    case 404:
    case 405:
      return "there is no STOW-RS at this address" + code;
    case 411:
    case 413:
      return "the request is too long for the server" + code;
    case 415:
      return "the server does not take this form" + code;
    case 503:
      return "the server is out of resources" + code;
    default:
      return "the server rejects the request" + code;
  }
}

// PS3.18 10.5.3 and I.2: what became of each object stands in the answer. Status 409 says that none was stored.
void judge(std::span<SentObject* const> batch, const pacs::Reply& reply) {
  const auto all = [&](const std::string& problem) {
    for (SentObject* const s : batch) s->problem = problem;
  };
  if (reply.status != 200 && reply.status != 202 && reply.status != 409) return all(status_words(reply.status));
  auto said = Json::parse(reply.text);
  if (said && said->find(kStored) == nullptr && said->items().size() == 1)
    said = Json(said->items()[0]);  // a list of one, as some write it
  if (!said || said->members().empty())
    return all("the server does not say what became of it (status " + std::to_string(reply.status) + ", no JSON)");
  std::map<std::string, std::string> stored, failed;  // UID -> what else it says
  for (const Json& item : values_of(*said, kStored))
    stored[text_in(item, kReferencedInstance)] =
        values_of(item, kWarningReason).empty() ? "" : reason_text(item, kWarningReason);
  for (const Json& item : values_of(*said, kFailed))
    failed[text_in(item, kReferencedInstance)] = reason_text(item, kFailureReason);
  for (SentObject* const s : batch) {
    const auto bad = failed.find(s->object.sop_instance), good = stored.find(s->object.sop_instance);
    if (bad != failed.end()) {
      s->problem = bad->second;
    } else if (good != stored.end() && reply.status != 409) {
      s->accepted = true;
      s->problem = good->second;
    } else {
      s->problem = "the server does not say what became of it (status " + std::to_string(reply.status) + ")";
    }
  }
}

std::string check(Web& web, SendReport& report, const Context& context) {
  std::map<std::pair<std::string, std::string>, std::vector<SentObject*>> series;
  for (SentObject& s : report.objects)
    if (s.accepted && pacs::is_uid(s.object.study) && pacs::is_uid(s.object.series))
      series[{s.object.study, s.object.series}].push_back(&s);
  if (series.empty()) return "nothing was accepted";
  try {
    for (auto& [uids, objects] : series) {
      context.check_cancelled();
      const std::set<std::string> have = web.instances(uids.first, uids.second);
      for (SentObject* const s : objects) s->found = have.contains(s->object.sop_instance);
    }
  } catch (const Error& e) {
    if (e.code() == ExitCode::cancelled) throw;
    return e.what();
  }
  return {};
}

// --- fetching
// ------------------------------------------------------------------------------------------------------------------------

// Parts of an answer, each into a file of its own, and judged there.
class Parts {
 public:
  Parts(const RemoteSeries& series, std::set<std::string> expected, const fs::path& folder, const FetchLimits& limits,
        const Context& context)
      : series_(series), expected_(std::move(expected)), folder_(folder), limits_(limits), context_(context) {}

  FetchReport got;

  void take(const pacs::Http& http, const pacs::Reply& head, std::string_view piece) {
    if (!reader_) begin(http, head);
    answer_ += piece.size();
    if (static_cast<double>(answer_) > limits_.series_gb * 1e9 + 1e6)
      throw Error(ExitCode::resources, "the series is larger than allowed", "--series-gb");
    reader_->feed(piece);
  }

  void finish(const pacs::Http& http) {
    if (!reader_ || !reader_->whole()) throw http.wrong("broke off in the middle of the series", "tried again later");
    if (static_cast<std::size_t>(got.images) != expected_.size())
      throw Error(ExitCode::failed,
                  "there are " + std::to_string(expected_.size()) + " objects in the series, and " +
                      std::to_string(got.images) + " came",
                  "more may have arrived meanwhile: ask again");
    Children reader;
    reader.start(
        0,
        [this] {
          const std::string problem = judge();
          std::cout << problem << std::flush;
          return problem.empty() ? 0 : 1;
        },
        kReader);
    std::optional<ChildEnd> end;
    while (!(end = reader.wait(0.2))) context_.check_cancelled();
    context_.check_cancelled();
    if (end->exit_code == 1 && !end->out.empty()) throw http.wrong(end->out);
    if (end->exit_code != 0) throw http.wrong("gives an object that brings its reader down");
  }

 private:
  void begin(const pacs::Http& http, const pacs::Reply& head) {
    const pacs::MediaType type = pacs::parse_media_type(head.type);
    const auto of = type.parameters.find("type");
    if (type.name != "multipart/related" || (of != type.parameters.end() && !alike(of->second, "application/dicom")))
      throw http.wrong("gives no DICOM objects in several parts", "is it the root of a DICOMweb server?");
    const auto boundary = type.parameters.find("boundary");
    reader_ = std::make_unique<pacs::MultipartReader>(
        boundary == type.parameters.end() ? "" : boundary->second,
        pacs::PartEvents{[&http, this](const auto& h) { open(http, h); },
                         [this](std::string_view data) { write(data); }, [this] { close(); }});
  }

  void open(const pacs::Http& http, const std::map<std::string, std::string>& head) {
    const auto of = head.find("content-type");
    if (of != head.end() && pacs::parse_media_type(of->second).name != "application/dicom")
      throw http.wrong("gives a part that is no DICOM object");
    if (static_cast<std::size_t>(got.images) == expected_.size()) throw http.wrong("gives more objects than it lists");
    file_.reset(std::fopen(name_of(got.images + 1).c_str(), "wbxe"));
    if (!file_) throw lost();
    bytes_ = 0;
    look_at_disk();
  }

  void write(std::string_view data) {
    if (static_cast<double>(bytes_ + data.size()) > limits_.object_gb * 1e9)
      throw Error(ExitCode::resources, "an object is larger than allowed", "--series-gb");
    if (bytes_ / kLook != (bytes_ + data.size()) / kLook) look_at_disk();
    bytes_ += data.size();
    got.bytes += data.size();
    if (static_cast<double>(got.bytes) > limits_.series_gb * 1e9)
      throw Error(ExitCode::resources, "the series is larger than allowed", "--series-gb");
    if (std::fwrite(data.data(), 1, data.size(), file_.get()) != data.size()) throw lost();
  }

  void close() {
    if (std::fflush(file_.get()) != 0) throw lost();
    file_.reset();
    ++got.images;
    context_.progress(static_cast<double>(got.images) / static_cast<double>(expected_.size()), "fetching");
  }

  // In a process of its own: what is wrong with what came, and empty when nothing is.
  std::string judge() {
    pacs::quiet_dcmtk(1);
    for (int n = 1; n <= got.images; ++n) {
      const fs::path file = name_of(n);
      pacs::ObjectHead head;
      DcmFileFormat whole;
      // To its last byte, long values by their length alone: a server may cut an object and end the part as it should.
      if (!is_file_of_part_10(file) || whole.loadFile(file.c_str(), EXS_Unknown, EGL_noChange, 1024).bad() ||
          !pacs::read_head(file, head))
        return "gives what is no whole DICOM object";
      if (head.study != series_.study || head.series != series_.series || expected_.erase(head.sop_instance) == 0)
        return "gives an object that was not asked for, or gives one twice";
    }
    return {};
  }

  [[nodiscard]] fs::path name_of(int n) const {
    char name[24];
    std::snprintf(name, sizeof name, "%06d.dcm", n);
    return folder_ / name;
  }

  void look_at_disk() const {
    std::error_code error;
    const auto space = fs::space(folder_, error);
    if (!error && static_cast<double>(space.available) < limits_.keep_free_gb * 1e9)
      throw Error(ExitCode::resources, "the disk is nearly full");
  }

  [[nodiscard]] static Error lost() {
    return {errno == ENOSPC ? ExitCode::resources : ExitCode::cannot_write,
            std::string("an object could not be stored: ") + std::strerror(errno)};
  }

  static constexpr std::uint64_t kLook = 64'000'000;  // bytes between looks at the disk
  const RemoteSeries& series_;
  std::set<std::string> expected_;
  const fs::path& folder_;
  const FetchLimits& limits_;
  const Context& context_;
  std::unique_ptr<pacs::MultipartReader> reader_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
  std::uint64_t bytes_ = 0, answer_ = 0;
};

}  // namespace

void check_dicomweb(const WebServer& server) {
  pacs::check_address(server);
  if (server.url.starts_with("http://") && !pacs::own_machine(server.url))
    throw Error(ExitCode::usage, "patients' data would go over the network in the clear",
                "https://, or a tunnel to 127.0.0.1");
}

SendReport send_objects(const WebServer& server, const std::vector<DicomObject>& objects, bool check_after,
                        const Context& context) {
  check_dicomweb(server);
  pacs::quiet_dcmtk(server.timeout_s);
  SendReport report;
  for (const DicomObject& o : objects) report.objects.push_back({o, false, {}, {}});
  std::map<std::string, std::vector<SentObject*>> studies;
  for (SentObject& s : report.objects) {
    if (is_file_of_part_10(s.object.file))
      studies[s.object.study].push_back(&s);
    else
      s.problem = "it has no file meta information, which DICOMweb needs";
  }
  Web web(server, context);
  std::string lost;  // why nothing more is sent
  std::size_t done = 0, answers = 0;
  for (auto& [study, all] : studies) {
    for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
      std::uint64_t bytes = 0;
      while (end < all.size() && end - begin < kBatchObjects &&
             (end == begin || bytes + all[end]->object.bytes <= kBatchBytes))
        bytes += all[end++]->object.bytes;
      const auto batch = std::span(all).subspan(begin, end - begin);
      context.progress(static_cast<double>(done) / static_cast<double>(objects.size()), "sending");
      done += batch.size();
      if (!lost.empty()) {
        for (SentObject* const s : batch) s->problem = lost;
        continue;
      }
      try {
        const Body body(batch);
        judge(
            batch,
            web.http().ask(
                {.path = "/studies", .accept = "application/dicom+json", .most = kMaxText, .upload = &body.upload()}));
        ++answers;
      } catch (const Error& e) {
        if (e.code() == ExitCode::cancelled || (answers == 0 && e.code() != ExitCode::cannot_read)) throw;
        for (SentObject* const s : batch) s->problem = e.what();
        if (e.code() != ExitCode::cannot_read) lost = std::string("not sent: ") + e.what();
      }
    }
  }
  report.not_checked = check_after ? check(web, report, context) : "not asked for";
  return report;
}

std::vector<RemoteSeries> find_series(const WebServer& server, const SeriesKeys& keys, const Context& context) {
  check_dicomweb(server);
  pacs::check_keys(keys);
  Web web(server, context);
  const auto key = [](const char* name, const std::string& value) {
    return value.empty() ? "" : name + ("=" + escaped(value)) + "&";
  };
  const auto agrees = [](const Json& match, const char* attribute, const std::string& asked) {
    const std::string given = text_in(match, attribute);
    return asked.empty() || given.empty() || alike(given, asked);
  };
  std::vector<RemoteSeries> all;
  const auto ask = [&](const std::string& path, const std::string& study, const std::string& date) {
    const std::string what = "?" + key("SeriesInstanceUID", keys.series) + key("Modality", keys.modality) +
                             "includefield=" + kSeriesDescription + "&includefield=" + kImages + "&";
    web.query(path, what, kSeries, kMaxSeries, [&](const Json& match, const std::string& uid) {
      RemoteSeries r{text_in(match, kStudy),
                     uid,
                     text_in(match, kModality),
                     text_in(match, kSeriesDescription),
                     date,
                     number_in(match, kSeriesNumber, 0),
                     number_in(match, kImages, -1)};
      if (r.study.empty()) r.study = study;  // the address says it
      if (!pacs::is_uid(r.study)) throw web.http().wrong("gives a match without a UID");
      if ((!study.empty() && r.study != study) || !agrees(match, kSeries, keys.series) ||
          !agrees(match, kModality, keys.modality))
        throw web.strange("series");
      if (all.size() == kMaxSeries)
        throw Error(ExitCode::usage, "more than " + std::to_string(kMaxSeries) + " match",
                    "ask for less: a date, a modality, a study");
      all.push_back(std::move(r));
    });
  };
  if (keys.study.empty() && keys.accession.empty() && keys.patient_id.empty() && keys.study_date.empty()) {
    ask("/series", "", "");
  } else {
    std::vector<std::pair<std::string, std::string>> studies;
    web.query("/studies",
              "?" + key("StudyInstanceUID", keys.study) + key("StudyDate", keys.study_date) +
                  key("AccessionNumber", keys.accession) + key("PatientID", keys.patient_id),
              kStudy, kMaxSeries, [&](const Json& match, const std::string& uid) {
                if (!agrees(match, kStudy, keys.study) || !agrees(match, kAccession, keys.accession) ||
                    !agrees(match, kPatientId, keys.patient_id))
                  throw web.strange("study");
                studies.emplace_back(uid, text_in(match, kStudyDate));
              });
    for (const auto& [uid, date] : studies) ask("/studies/" + uid + "/series", uid, date);
  }
  std::ranges::sort(all, pacs::before);
  return all;
}

FetchReport fetch_series(const WebServer& server, const RemoteSeries& series, const fs::path& folder,
                         const FetchLimits& limits, const Context& context) {
  check_dicomweb(server);
  if (!fs::is_directory(folder) || !fs::is_empty(folder))
    throw Error(ExitCode::cannot_write, folder.string() + " is no empty folder");
  for (const std::string& uid : {series.study, series.series})
    if (!pacs::is_uid(uid)) throw Error(ExitCode::usage, "'" + uid + "' is no UID", "digits and dots, at most 64");
  pacs::quiet_dcmtk(server.timeout_s);
  Web web(server, context);
  std::set<std::string> listed = web.instances(series.study, series.series);
  if (listed.empty()) throw Error(ExitCode::no_input, web_text(server) + " has nothing of this series");
  if (series.images >= 0 && listed.size() != static_cast<std::size_t>(series.images))
    throw Error(ExitCode::failed,
                "there are " + std::to_string(series.images) + " objects in the series, and " +
                    std::to_string(listed.size()) + " are listed",
                "more may have arrived meanwhile: ask again");
  Parts parts(series, std::move(listed), folder, limits, context);
  const pacs::Reply reply = web.http().ask(
      {.path = "/studies/" + series.study + "/series/" + series.series,
       .accept = R"(multipart/related; type="application/dicom"; transfer-syntax=*)",
       .most = kMaxText,
       .take = [&](const pacs::Reply& head, std::string_view piece) { parts.take(web.http(), head, piece); }});
  if (reply.status != 200)
    throw web.http().wrong("does not give the series (status " + std::to_string(reply.status) + ")");
  parts.finish(web.http());
  return parts.got;
}

}  // namespace osteo::inline hospital
