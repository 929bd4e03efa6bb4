#include "association.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <exception>
#include <fstream>
#include <new>

#include "dcmtk/dcmdata/dcuid.h"
#include "node_tables.h"

namespace osteo::inline hospital::pacs {
namespace {

constexpr unsigned kDuplicate = 0x0111, kBadUid = 0x0117, kNoMatch = 0xA900, kNoRoom = 0xA700,
                   kCannotUnderstand = 0xC000;

void limit(int what, double most) {
  rlimit r{};
  getrlimit(what, &r);
  r.rlim_cur = r.rlim_max = std::min(r.rlim_max, static_cast<rlim_t>(most));
  setrlimit(what, &r);
}

// Of address space that this process has taken already: most of it libraries that were never touched.
double taken_bytes() {
  std::ifstream in("/proc/self/statm");
  double pages = 0;
  in >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

// The data sets of two files, without what a node may have written before them.
bool same_data_set(const fs::path& a, const fs::path& b) {
  const auto data = [](std::ifstream& in) {
    std::array<unsigned char, 144> head{};
    if (!in.read(reinterpret_cast<char*>(head.data()), head.size())) return false;
    const std::uint64_t group =
        head[140] | head[141] << 8U | head[142] << 16U | static_cast<std::uint64_t>(head[143]) << 24U;
    return static_cast<bool>(in.seekg(static_cast<std::streamoff>(group), std::ios::cur));
  };
  std::ifstream x(a, std::ios::binary), y(b, std::ios::binary);
  if (!data(x) || !data(y)) return false;
  std::array<char, 65536> p{}, q{};
  do {
    x.read(p.data(), p.size());
    y.read(q.data(), q.size());
    if (x.gcount() != y.gcount() || !std::equal(p.begin(), p.begin() + x.gcount(), q.begin())) return false;
  } while (x && y);
  return true;
}

SharedCounts* counts_of_process = nullptr;

// When this process ends, whoever keeps it waiting: DCMTK's own limits are for each read, and one byte is enough for
// each.
class Deadline {
 public:
  Deadline(const ReceiveOptions& options, SharedCounts& counts) : timeout_s_(options.timeout_s) {
    counts_of_process = &counts;
    std::signal(SIGALRM, [](int) {
      ++counts_of_process->timed_out;
      ::_exit(4);
    });
    end_s_ = now_s() + options.association_s;
    message();
  }
  /// One begins.
  void message() {
    begin_s_ = now_s();
    came(0);
  }
  /// Of its object, so much has come.
  void came(std::uint64_t bytes) { set(begin_s_ + timeout_s_ + static_cast<double>(bytes) / kReceiveBytesPerS); }
  /// It is whole: what we do with it is no peer's fault.
  void none() { set(end_s_); }

 private:
  static double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  void set(double at_s) const {
    const double in_s = std::max(0.001, std::min(at_s, end_s_) - now_s());
    itimerval t{};
    t.it_value.tv_sec = static_cast<time_t>(in_s);
    t.it_value.tv_usec = static_cast<suseconds_t>((in_s - std::floor(in_s)) * 1e6);
    if (t.it_value.tv_sec == 0 && t.it_value.tv_usec == 0) t.it_value.tv_usec = 1;
    ::setitimer(ITIMER_REAL, &t, nullptr);
  }
  const double timeout_s_;
  double end_s_ = 0, begin_s_ = 0;
};

struct Serving {
  const fs::path& folder;
  const ReceiveOptions& options;
  SharedCounts& counts;
  Deadline& deadline;
  int pipe;
  std::string from;         // title of who sends
  fs::path file;            // that is coming in
  std::uint64_t bytes = 0;  // of its data set, so far
};

// An object that has come whole into `s.file`: into its place, or why not.
unsigned keep(Serving& s, const T_DIMSE_C_StoreRQ& request) {
  if (!is_uid(request.AffectedSOPInstanceUID) || !is_uid(request.AffectedSOPClassUID)) return kBadUid;
  if (!holds_data_set(s.file, s.bytes)) return kNoRoom;
  ObjectHead head;
  if (!read_head(s.file, head)) return kCannotUnderstand;
  if (!is_uid(head.study) || !is_uid(head.series)) return kBadUid;
  if (head.sop_class != request.AffectedSOPClassUID || head.sop_instance != request.AffectedSOPInstanceUID)
    return kNoMatch;
  const fs::path place = place_of(head), whole = s.folder / place;
  std::error_code error;
  fs::create_directories(whole.parent_path(), error);
  if (error) return kNoRoom;
  // A link fails where there is something, so that nothing is ever written over, whoever else receives it at this
  // moment.
  if (::link(s.file.c_str(), whole.c_str()) != 0) {
    if (errno != EEXIST) return kNoRoom;
    if (!same_data_set(s.file, whole)) return kDuplicate;
    ++s.counts.again;
    return STATUS_Success;
  }
  s.counts.bytes += s.bytes;
  ++s.counts.stored;
  const std::string line = place.parent_path().string() + "\t" + s.from + "\n";
  [[maybe_unused]] const auto reported = ::write(s.pipe, line.data(), line.size());
  return STATUS_Success;
}

bool room(const Serving& s) {
  struct statvfs disk {};
  if (::statvfs(s.folder.c_str(), &disk) != 0) return false;
  return static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) > s.options.keep_free_gb * 1e9 &&
         static_cast<double>(s.counts.folder_before) + static_cast<double>(s.counts.bytes) < s.options.folder_gb * 1e9;
}

void came(void* data, T_DIMSE_StoreProgress* progress, T_DIMSE_C_StoreRQ* request, char*, DcmDataset**,
          T_DIMSE_C_StoreRSP* response, DcmDataset**) {
  Serving& s = *static_cast<Serving*>(data);
  if (progress->progressBytes > 0) s.bytes = static_cast<std::uint64_t>(progress->progressBytes);
  s.deadline.came(s.bytes);
  if (progress->state != DIMSE_StoreEnd) return;
  s.deadline.none();
  // Before this, DCMTK has set the status to what happened on the way.
  if (response->DimseStatus == STATUS_Success)
    response->DimseStatus = static_cast<Uint16>(room(s) ? keep(s, *request) : kNoRoom);
  if (response->DimseStatus != STATUS_Success) ++s.counts.refused;
}

OFCondition store(T_ASC_Association* association, T_ASC_PresentationContextID id, T_DIMSE_C_StoreRQ& request,
                  Serving& s) {
  char name[32];
  static int number = 0;
  std::snprintf(name, sizeof name, "%d-%d", ::getpid(), number++);
  ::mkdir((s.folder / kIncoming).c_str(),
          0777);  // whoever has emptied the inbox may have taken it; not more than it: a disk may be away
  s.file = s.folder / kIncoming / name;
  s.bytes = 0;
  const int timeout = static_cast<int>(std::ceil(s.options.timeout_s));
  const OFCondition done = DIMSE_storeProvider(association, id, &request, s.file.c_str(), OFTrue, nullptr, came, &s,
                                               DIMSE_NONBLOCKING, timeout);
  ::unlink(s.file.c_str());
  return done;
}

void reject(T_ASC_Association* association, SharedCounts& counts, T_ASC_RejectParametersResult result,
            T_ASC_RejectParametersSource source, T_ASC_RejectParametersReason reason) {
  ++counts.refused_associations;
  const T_ASC_RejectParameters why{result, source, reason};
  ASC_rejectAssociation(association, &why);
}

// Whether the peer may come in; the answer is given.
bool let_in(T_ASC_Association* association, const ReceiveOptions& options, SharedCounts& counts) {
  char calling[65] = "", called[65] = "", responding[65] = "";
  ASC_getAPTitles(association->params, calling, sizeof calling, called, sizeof called, responding, sizeof responding);
  const auto title = [](const char* text) {
    try {
      return checked_ae(text);
    } catch (const Error&) {
      return std::string();
    }
  };
  if (title(called) != options.ae) {
    reject(association, counts, ASC_RESULT_REJECTEDPERMANENT, ASC_SOURCE_SERVICEUSER,
           ASC_REASON_SU_CALLEDAETITLENOTRECOGNIZED);
    return false;
  }
  const std::string from = title(calling);
  if (from.empty() || (!options.anybody && std::ranges::find(options.allowed, from) == options.allowed.end())) {
    reject(association, counts, ASC_RESULT_REJECTEDPERMANENT, ASC_SOURCE_SERVICEUSER,
           ASC_REASON_SU_CALLINGAETITLENOTRECOGNIZED);
    return false;
  }
  char context[129] = "";
  ASC_getApplicationContextName(association->params, context, sizeof context);
  if (std::string_view(context) != UID_StandardApplicationContext) {
    reject(association, counts, ASC_RESULT_REJECTEDPERMANENT, ASC_SOURCE_SERVICEUSER,
           ASC_REASON_SU_APPCONTEXTNAMENOTSUPPORTED);
    return false;
  }
  std::vector<const char*> forms, plain, classes;
  for (const UidRow& row : kNodeSyntaxes) forms.push_back(row.uid.data());
  for (const UidRow& row : kPlainSyntaxes) plain.push_back(row.uid.data());
  for (const UidRow& row : kStorageClasses) classes.push_back(row.uid.data());
  const char* echo[] = {kVerification.uid.data()};
  OFCondition done = ASC_acceptContextsWithPreferredTransferSyntaxes(association->params, echo, 1, plain.data(),
                                                                     static_cast<int>(plain.size()));
  if (done.good())
    done = ASC_acceptContextsWithPreferredTransferSyntaxes(association->params, classes.data(),
                                                           static_cast<int>(classes.size()), forms.data(),
                                                           static_cast<int>(forms.size()));
  return done.good() && ASC_acknowledgeAssociation(association).good();
}

}  // namespace

fs::path place_of(const ObjectHead& head) {
  return fs::path("study-" + hash_text(head.study).substr(0, 12)) / ("series-" + hash_text(head.series).substr(0, 12)) /
         (hash_text(head.sop_instance).substr(0, 24) + ".dcm");
}

void serve(int connection, int pipe, const fs::path& folder, const ReceiveOptions& options, SharedCounts& counts) {
  // A peer can end this process and nothing else. It ends at once: what the program does on its way out waits for
  // threads that a child has not.
  std::set_new_handler([] { ::_exit(5); });
  std::set_terminate([] { ::_exit(6); });
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, options.object_gb * 1e9);
  limit(RLIMIT_CPU, options.association_s);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  limit(RLIMIT_AS, taken_bytes() + options.memory_mb * 1e6);
#endif
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  Deadline deadline(options, counts);
  quiet_dcmtk(options.timeout_s);
  const int timeout = static_cast<int>(std::ceil(options.timeout_s));
  T_ASC_Network* network = nullptr;
  T_ASC_Association* association = nullptr;
  dcmExternalSocketHandle.set(connection);
  if (ASC_initializeNetwork(NET_ACCEPTOR, 0, timeout, &network).bad()) ::_exit(3);
  const std::unique_ptr<DcmTLSTransportLayer> layer = tls_layer(options.tls, NET_ACCEPTOR);
  if (layer != nullptr && ASC_setTransportLayer(network, layer.get(), 0).bad()) ::_exit(3);
  const OFBool secure = layer != nullptr ? OFTrue : OFFalse;
  if (ASC_receiveAssociation(network, &association, ASC_DEFAULTMAXPDU, nullptr, nullptr, secure, DUL_NOBLOCK, timeout)
          .bad()) {
    ++counts.refused_associations;
    ::_exit(2);
  }
  if (!let_in(association, options, counts)) ::_exit(2);
  char calling[65] = "", called[65] = "", responding[65] = "";
  ASC_getAPTitles(association->params, calling, sizeof calling, called, sizeof called, responding, sizeof responding);
  Serving s{folder, options, counts, deadline, pipe, checked_ae(calling), {}, 0};
  for (;;) {
    // Waiting for a message has its own time. What was read before may hold the next one, and nothing is on its way.
    deadline.none();
    const bool waits = ASC_dataWaiting(association, timeout);
    deadline.message();
    T_DIMSE_Message message{};
    T_ASC_PresentationContextID id = 0;
    const OFCondition got =
        DIMSE_receiveCommand(association, DIMSE_NONBLOCKING, waits ? timeout : 1, &id, &message, nullptr);
    if (got == DUL_PEERREQUESTEDRELEASE) {
      ASC_acknowledgeRelease(association);
      ASC_dropSCPAssociation(association, 1);
      ::_exit(0);
    }
    if (got == DUL_PEERABORTEDASSOCIATION) ::_exit(0);
    OFCondition done = got;
    if (got == DIMSE_NODATAAVAILABLE) ++counts.timed_out;
    if (got.good()) {
      switch (message.CommandField) {
        case DIMSE_C_ECHO_RQ:
          done = DIMSE_sendEchoResponse(association, id, &message.msg.CEchoRQ, STATUS_Success, nullptr);
          break;
        case DIMSE_C_STORE_RQ:
          done = store(association, id, message.msg.CStoreRQ, s);
          break;
        default:
          done = DIMSE_BADCOMMANDTYPE;
      }
    }
    if (done.bad()) {
      ASC_abortAssociation(association);
      ::_exit(4);
    }
  }
}

}  // namespace osteo::inline hospital::pacs
