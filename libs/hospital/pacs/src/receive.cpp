#include "osteo/hospital/pacs/receive.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <new>
#include <set>

#include "association.h"
#include "inbox.h"

namespace osteo::inline hospital {
namespace {

using Clock = std::chrono::steady_clock;
using pacs::SharedCounts;

// The folder is measured as an association begins and every so often, but for no more than a twentieth of the time.
constexpr std::chrono::seconds kMeasureEvery{10};
constexpr int kMeasureShare = 20;

struct Descriptor {
  int value = -1;
  Descriptor() = default;
  explicit Descriptor(int fd) : value(fd) {}
  Descriptor(Descriptor&& other) noexcept : value(std::exchange(other.value, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value, other.value);
    return *this;
  }
  ~Descriptor() {
    if (value >= 0) ::close(value);
  }
};

// Memory that children write and the parent reads.
class SharedPage {
 public:
  SharedPage() {
    void* const page = ::mmap(nullptr, sizeof(SharedCounts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (page == MAP_FAILED) throw Error(ExitCode::resources, "no memory to count in");
    counts_ = new (page) SharedCounts;
  }
  ~SharedPage() { ::munmap(counts_, sizeof(SharedCounts)); }
  SharedPage(const SharedPage&) = delete;
  SharedPage& operator=(const SharedPage&) = delete;
  SharedCounts& operator*() const { return *counts_; }

 private:
  SharedCounts* counts_;
};

Descriptor listen_at(const ReceiveOptions& o, int& port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(o.port));
  if (::inet_pton(AF_INET, o.address.c_str(), &at.sin_addr) != 1)
    throw Error(ExitCode::usage, "'" + o.address + "' is no IPv4 address to listen on",
                "127.0.0.1 for this machine alone, 0.0.0.0 for every network");
  Descriptor fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  ::setsockopt(fd.value, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof at;
  if (fd.value < 0 || ::bind(fd.value, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 ||
      ::listen(fd.value, 64) != 0 || ::getsockname(fd.value, reinterpret_cast<sockaddr*>(&at), &size) != 0)
    throw Error(ExitCode::failed,
                "cannot listen on " + o.address + ":" + std::to_string(o.port) + ": " + std::strerror(errno),
                "--port another, or stop what listens there");
  port = ntohs(at.sin_port);
  return fd;
}

void check(const ReceiveOptions& o) {
  static_cast<void>(checked_ae(o.ae));
  for (const std::string& title : o.allowed) static_cast<void>(checked_ae(title));
  if (o.allowed.empty() && !o.anybody)
    throw Error(ExitCode::usage, "nobody may send",
                "--allow TITLE,TITLE names the nodes that may; --allow-all lets all in");
  static_cast<void>(pacs::tls_layer(o.tls, NET_ACCEPTOR));  // what is wrong with its files is told now
}

struct Child {
  pid_t pid = 0;
  Descriptor pipe;
  std::string rest;  // of a line
};

class Node {
 public:
  Node(fs::path folder, const ReceiveOptions& options, const ReceiveEvents& events, const Context& context)
      : folder_(std::move(folder)),
        options_(options),
        events_(events),
        context_(context),
        inbox_(folder_, options.quiet_s, [this](const std::string& what) { context_.warn(what); }) {
    make_output_folder(folder_ / pacs::kIncoming);
    lock();
    clear_incoming({});  // of a process that died
    measure();
    inbox_.open_unclosed(Clock::now());
    int port = 0;
    listener_ = listen_at(options_, port);
    if (events_.listening) events_.listening(port);
  }
  ~Node() {
    for (const Child& c : children_) ::kill(c.pid, SIGKILL);
    for (const Child& c : children_) ::waitpid(c.pid, nullptr, 0);
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void run() {
    while (!context_.cancelled()) {
      std::vector<pollfd> watched{{listener_.value, POLLIN, 0}};
      for (const Child& c : children_) watched.push_back({c.pipe.value, POLLIN, 0});
      ::poll(watched.data(), watched.size(), 200);
      // Children before connections: accepting one changes their number.
      for (std::size_t n = 0; n < children_.size(); ++n)
        if (watched[n + 1].revents != 0) hear(children_[n]);
      bury();
      if ((watched[0].revents & POLLIN) != 0) accept();
      for (ClosedSeries closed : inbox_.close_quiet(Clock::now())) {
        closed.from = std::exchange(from_[closed.folder], {});
        from_.erase(closed.folder);
        ++seen_.closed;
        if (events_.closed) events_.closed(closed);
      }
      if (Clock::now() - measured_at_ > kMeasureEvery) measure();
      notify(false);
    }
    notify(true);
  }

 private:
  // Two nodes in one folder would clear away what the other is writing.
  void lock() {
    lock_ = Descriptor(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    // A file system without locks (some of a network's) is taken as it is.
    if (lock_.value >= 0 && ::flock(lock_.value, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw Error(ExitCode::cannot_write, "another node receives into '" + folder_.string() + "'",
                  "give another folder, or stop it");
  }

  // What processes whose names begin so were writing.
  void clear_incoming(const std::string& begin) {
    std::error_code error;
    std::vector<fs::path> left;
    for (fs::directory_iterator at(folder_ / pacs::kIncoming, error), end; !error && at != end; at.increment(error))
      if (at->path().filename().string().starts_with(begin)) left.push_back(at->path());
    for (const fs::path& path : left) fs::remove(path, error);
  }

  // How full the folder is, for all processes.
  void measure() {
    const auto begin = Clock::now();
    if (measured_at_ != Clock::time_point{} && begin - measured_at_ < kMeasureShare * measuring_took_) return;
    // Before: what comes while it is measured may count twice until the next time, but never not at all.
    const auto came = static_cast<std::int64_t>((*counts_).bytes.load());
    (*counts_).folder_before = static_cast<std::int64_t>(inbox_.measure(begin)) - came;
    measured_at_ = Clock::now();
    measuring_took_ = measured_at_ - begin;
    std::error_code error;
    const bool there = fs::is_directory(folder_, error);
    if (!there && folder_there_) context_.warn("the inbox is gone: objects are rejected until it is there again");
    folder_there_ = there;
  }

  void accept() {
    Descriptor connection(::accept4(listener_.value, nullptr, nullptr, SOCK_CLOEXEC));
    if (connection.value < 0) return;
    ++seen_.associations;
    if (children_.size() >= static_cast<std::size_t>(options_.most_associations)) {
      // A-ASSOCIATE-RJ, rejected for now, by the provider, local limit exceeded (PS3.8 9.3.4): no process is made for
      // it.
      constexpr std::array<unsigned char, 10> kBusy{3, 0, 0, 0, 0, 4, 0, 2, 3, 2};
      ::send(connection.value, kBusy.data(), kBusy.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      ++(*counts_).refused_associations;
      return;
    }
    measure();
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return;
    Descriptor in(ends[0]), out(ends[1]);
    const pid_t pid = ::fork();
    if (pid == 0) {
      ::close(listener_.value);
      if (lock_.value >= 0)
        ::close(lock_.value);  // a node that is killed leaves the folder to the next one, whatever we still do
      for (const Child& c : children_) ::close(c.pipe.value);
      std::signal(SIGTERM, SIG_DFL);
      std::signal(SIGINT, SIG_IGN);  // Ctrl-C is for the parent, which ends us
      try {
        pacs::serve(connection.value, out.value, folder_, options_, *counts_);
      } catch (...) {  // a certificate that is being renewed, say: what stands below this child is its parent's
        ::_exit(6);
      }
    }
    if (pid < 0) {
      ++(*counts_).refused_associations;
      return;
    }
    ::fcntl(in.value, F_SETFL, O_NONBLOCK);
    children_.push_back({pid, std::move(in), {}});
  }

  void hear(Child& child) {
    char text[4096];
    ssize_t n = 0;
    while ((n = ::read(child.pipe.value, text, sizeof text)) > 0) child.rest.append(text, static_cast<std::size_t>(n));
    // It has closed its end: it is going, and if it were stuck on its way nobody would come for it.
    if (n == 0) ::kill(child.pid, SIGKILL);
    for (std::size_t end = 0; (end = child.rest.find('\n')) != std::string::npos;) {
      const std::string line = child.rest.substr(0, end);  // the series' folder and the sender's title
      const std::size_t tab = line.find('\t');
      inbox_.came(line.substr(0, tab), Clock::now());
      from_[folder_ / line.substr(0, tab)].insert(line.substr(tab + 1));
      child.rest.erase(0, end + 1);
    }
  }

  void bury() {
    std::erase_if(children_, [&](Child& c) {
      int status = 0;
      if (::waitpid(c.pid, &status, WNOHANG) != c.pid) return false;
      hear(c);
      // 5, 6: out of memory, a fault that throws.
      const bool faulted = WIFEXITED(status) && (WEXITSTATUS(status) == 5 || WEXITSTATUS(status) == 6);
      if (faulted || (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)) {
        ++seen_.died;
        context_.warn("the process of an association was ended by a limit or a fault");
      }
      clear_incoming(std::to_string(c.pid) + "-");  // what it was writing
      return true;
    });
  }

  void notify(bool last) {
    const SharedCounts& c = *counts_;
    ReceiveCounters now = seen_;
    now.refused_associations = c.refused_associations;
    now.stored = c.stored;
    now.again = c.again;
    now.refused = c.refused;
    now.bytes = c.bytes;
    now.timed_out = c.timed_out;
    now.gone = inbox_.gone();
    if (!last && (now == reported_ || Clock::now() - reported_at_ < std::chrono::seconds(1))) return;
    reported_ = now;
    reported_at_ = Clock::now();
    if (!events_.counters) return;
    try {
      events_.counters(now);
      counters_failed_ = false;
    } catch (const Error& e) {  // a full disk, say: no reason to reject what still can be kept
      if (!std::exchange(counters_failed_, true)) context_.warn(std::string("the counters: ") + e.what());
    }
  }

  fs::path folder_;
  const ReceiveOptions& options_;
  const ReceiveEvents& events_;
  const Context& context_;
  SharedPage counts_;
  Descriptor listener_;
  std::vector<Child> children_;
  Descriptor lock_;
  pacs::Inbox inbox_;
  std::map<fs::path, std::set<std::string>> from_;  // of series that are open
  Clock::time_point measured_at_{};
  Clock::duration measuring_took_{};
  bool folder_there_ = true, counters_failed_ = false;
  ReceiveCounters seen_, reported_;
  Clock::time_point reported_at_{};
};

}  // namespace

void receive_objects(const fs::path& folder, const ReceiveOptions& options, const ReceiveEvents& events,
                     const Context& context) {
  check(options);
  pacs::warn_of_open_key(options.tls, context);
  try {
    Node(folder, options, events, context).run();
  } catch (const fs::filesystem_error& e) {
    throw error_of(e);
  }
}

std::string metrics_text(const ReceiveCounters& c) {
  std::string text;
  const auto row = [&](const char* name, const char* help, std::uint64_t value) {
    const std::string full = std::string("osteotome_receive_") + name + "_total";
    text +=
        "# HELP " + full + " " + help + "\n# TYPE " + full + " counter\n" + full + " " + std::to_string(value) + "\n";
  };
  row("associations", "connections", c.associations);
  row("refused_associations", "connections that were not let in", c.refused_associations);
  row("died", "processes of associations ended by a limit or a fault", c.died);
  row("timed_out", "associations ended because a message, or all of it, took too long", c.timed_out);
  row("stored", "objects stored", c.stored);
  row("again", "objects that were there already", c.again);
  row("refused", "objects rejected", c.refused);
  row("bytes", "bytes of data sets stored", c.bytes);
  row("closed_series", "series closed after quiet", c.closed);
  row("gone_series", "series moved or deleted before they were closed", c.gone);
  return text;
}

}  // namespace osteo::inline hospital
