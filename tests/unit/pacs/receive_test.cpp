// A receiving node to whom things happen: its inbox emptied, moved, full, its clock set back, months of traffic, peers
// that drip.
#include "osteo/hospital/pacs/receive.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <thread>

#include "inbox.h"
#include "osteo/core/base/error.h"
#include "osteo/hospital/pacs/send.h"

namespace osteo {
namespace {

using pacs::Inbox;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

std::atomic<bool> stopped{false};

// A small DICOM file: what a node looks at, and pixels.
void write_object(const fs::path& file, const std::string& series, const std::string& instance, std::size_t pixels) {
  const auto number = [](std::size_t n, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>(n >> (8 * i) & 0xff);
    return text;
  };
  const auto element = [&](std::size_t group, std::size_t tag, const std::string& kind, std::string value) {
    if (value.size() % 2 != 0) value += '\0';
    const bool is_long = kind == "OB" || kind == "OW";
    return number(group, 2) + number(tag, 2) + kind +
           (is_long ? number(0, 2) + number(value.size(), 4) : number(value.size(), 2)) + value;
  };
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2";
  const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) + element(2, 2, "UI", ct) +
                           element(2, 3, "UI", instance) + element(2, 0x10, "UI", "1.2.840.10008.1.2.1") +
                           element(2, 0x12, "UI", "1.2.3.4");
  write_file(file, std::string(128, '\0') + "DICM" + element(2, 0, "UL", number(meta.size(), 4)) + meta +
                       element(8, 0x16, "UI", ct) + element(8, 0x18, "UI", instance) +
                       element(0x20, 0xd, "UI", "1.2.3.5") + element(0x20, 0xe, "UI", series) +
                       element(0x7fe0, 0x10, "OW", std::string(pixels, 'x')));
}

// --- the inbox alone, with a clock of our own

class InboxTest : public ::testing::Test {
 protected:
  TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path() / "inbox";
  std::vector<std::string> warned_;
  Inbox inbox_{folder_, 30, [this](const std::string& what) { warned_.push_back(what); }};
  Clock::time_point now_ = Clock::now();

  fs::path series(const std::string& name, int files, std::size_t bytes) {
    const fs::path place = fs::path("study-a") / ("series-" + name);
    fs::create_directories(folder_ / place);
    for (int i = 0; i < files; ++i)
      std::ofstream(folder_ / place / (std::to_string(i) + ".dcm")) << std::string(bytes, 'x');
    return place;
  }
};

TEST_F(InboxTest, WhatGoesBeforeItIsClosedIsToldOnceAndStopsNothing) {
  for (const char* name : {"whole", "deleted", "moved", "emptied"}) inbox_.came(series(name, 3, 100), now_);
  inbox_.came("study-a/series-never", now_);
  EXPECT_TRUE(inbox_.close_quiet(now_ + 29s).empty());
  fs::remove_all(folder_ / "study-a/series-deleted");
  fs::rename(folder_ / "study-a/series-moved", temporary_.path() / "elsewhere");
  for (int i = 0; i < 3; ++i) fs::remove(folder_ / "study-a/series-emptied" / (std::to_string(i) + ".dcm"));
  const auto closed = inbox_.close_quiet(now_ + 31s);
  ASSERT_EQ(closed.size(), 1U);
  EXPECT_EQ(closed[0].folder, folder_ / "study-a/series-whole");
  EXPECT_EQ(closed[0].objects, 3U);
  EXPECT_EQ(closed[0].bytes, 300U);
  EXPECT_EQ(warned_.size(), 4U);
  EXPECT_EQ(inbox_.gone(), 4U);
  EXPECT_EQ(inbox_.open(), 0U);
  EXPECT_TRUE(inbox_.close_quiet(now_ + 100s).empty());
  EXPECT_EQ(warned_.size(), 4U);
  // The whole of it goes, and what comes later is as if nothing had been.
  inbox_.came(series("late", 1, 10), now_);
  fs::remove_all(folder_);
  EXPECT_TRUE(inbox_.close_quiet(now_ + 31s).empty());
  EXPECT_EQ(inbox_.measure(now_), 0U);
  inbox_.came(series("later", 2, 10), now_ + 40s);
  EXPECT_EQ(inbox_.close_quiet(now_ + 71s).size(), 1U);
}

TEST_F(InboxTest, ASeriesThatCannotBeMarkedWaits) {
  inbox_.came(series("a", 2, 10), now_);
  fs::create_directories(folder_ / "study-a/series-a/CLOSED/in the way");
  EXPECT_TRUE(inbox_.close_quiet(now_ + 31s).empty());
  EXPECT_TRUE(inbox_.close_quiet(now_ + 62s).empty());
  ASSERT_EQ(warned_.size(), 1U);
  EXPECT_NE(warned_[0].find("cannot be closed yet"), std::string::npos);
  fs::remove_all(folder_ / "study-a/series-a/CLOSED");
  EXPECT_EQ(inbox_.close_quiet(now_ + 93s).size(), 1U);
  EXPECT_EQ(inbox_.gone(), 0U);
}

TEST_F(InboxTest, AtAStartWhatIsNotClosedIsOpen) {
  series("a", 2, 10);
  write_file(folder_ / series("b", 2, 10) / "CLOSED", "2 objects\n");
  series("c", 0, 0);
  inbox_.open_unclosed(now_);
  EXPECT_EQ(inbox_.open(), 1U);
  inbox_.came("study-a/series-b", now_);  // and so is what something comes to
  EXPECT_FALSE(fs::exists(folder_ / "study-a/series-b/CLOSED"));
  EXPECT_EQ(inbox_.close_quiet(now_ + 31s).size(), 2U);
}

TEST_F(InboxTest, WhatIsThereNowIsMeasured) {
  EXPECT_EQ(inbox_.measure(now_), 0U);
  series("a", 3, 100);
  series("b", 2, 50);
  fs::create_directories(folder_ / ".incoming");
  write_file(folder_ / ".incoming/1-0", std::string(999, 'x'));
  // Looked at again after a while, and known from then on.
  for (int s = 0; s < 20; ++s) EXPECT_EQ(inbox_.measure(now_ += 1s), 400U);
  series("c", 1, 7);
  fs::remove(folder_ / "study-a/series-a/0.dcm");
  EXPECT_EQ(inbox_.measure(now_ += 1s), 307U);
  // A clock that is set back: the folder changes, and its time is an earlier one.
  for (int s = 0; s < 20; ++s) static_cast<void>(inbox_.measure(now_ += 1s));
  write_file(folder_ / "study-a/series-b/9.dcm", std::string(1000, 'x'));
  fs::last_write_time(folder_ / "study-a/series-b", fs::file_time_type::clock::now() - 1000h);
  EXPECT_EQ(inbox_.measure(now_), 1307U);
  fs::remove_all(folder_ / "study-a");
  EXPECT_EQ(inbox_.measure(now_), 0U);
  EXPECT_TRUE(warned_.empty());
}

TEST_F(InboxTest, AQuarterOfAYear) {
  // Each day some come, by night it is emptied, by moving or deleting; on some days not. Only one day waits
  // until they are closed.
  std::size_t closed = 0, came = 0;
  for (int day = 0; day < 90; ++day) {
    for (int s = 0; s < 2; ++s, ++came)
      inbox_.came(series(std::to_string(day) + "-" + std::to_string(s), 1, 1000), now_ += 10s);
    std::uint64_t there = 0;
    for (const auto& file : fs::recursive_directory_iterator(folder_))
      there += file.is_regular_file() ? file.file_size() : 0;
    EXPECT_EQ(inbox_.measure(now_), there) << day;
    if (day == 30) closed += inbox_.close_quiet(now_ += 1h).size();
    if (day % 7 == 6) continue;
    const fs::path away = temporary_.path() / ("away-" + std::to_string(day));
    if (day % 2 == 0)
      fs::rename(folder_ / "study-a", away);
    else
      fs::remove_all(folder_ / "study-a");
    EXPECT_EQ(inbox_.measure(now_ += 18h), 0U) << day;
  }
  closed += inbox_.close_quiet(now_ += 1h).size();
  EXPECT_EQ(inbox_.open(), 0U);
  EXPECT_GE(closed, 2U);
  EXPECT_EQ(closed + inbox_.gone(), came);
  EXPECT_EQ(warned_.size(), inbox_.gone());
}

// --- a node in a process of its own

class Node {
 public:
  Node(const fs::path& folder, ReceiveOptions o) {
    o.anybody = true;
    o.port = 0;
    o.keep_free_gb = 0;
    int ends[2];
    if (::pipe(ends) != 0) std::abort();
    process_ = ::fork();
    if (process_ == 0) {
      ::close(ends[0]);
      const auto say = [&](const std::string& line) {
        [[maybe_unused]] const auto n = ::write(ends[1], line.data(), line.size());
      };
      std::signal(SIGTERM, [](int) { stopped = true; });
      Context context;
      context.set_cancel_flag(&stopped);
      context.on_log([&](LogLevel, std::string_view what) { say("warned " + std::string(what) + "\n"); });
      ReceiveEvents events;
      events.listening = [&](int at) { say("listens " + std::to_string(at) + "\n"); };
      events.closed = [&](const ClosedSeries& s) { say("closed " + std::to_string(s.objects) + "\n"); };
      events.counters = [&](const ReceiveCounters& c) {
        say("counts " + std::to_string(c.stored) + " stored " + std::to_string(c.timed_out) + " timed out " +
            std::to_string(c.died) + " died\n");
      };
      int code = 0;
      try {
        receive_objects(folder, o, events, context);
      } catch (const Error& e) {
        say(std::string("failed ") + e.what() + "\n");
        code = static_cast<int>(e.code());
      }
      ::_exit(code);
    }
    ::close(ends[1]);
    out_ = ends[0];
    const std::string line = wait_for("");
    if (line.starts_with("listens ")) port = std::stoi(line.substr(8));
  }
  ~Node() {
    if (process_ > 0) static_cast<void>(stop());
    ::close(out_);
  }
  // The next line that begins so; empty when it has ended, or says nothing for twenty seconds. All lines are kept.
  std::string wait_for(const std::string& begin) {
    for (;;) {
      for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos;) {
        const std::string line = rest_.substr(0, end);
        rest_.erase(0, end + 1);
        said.push_back(line);
        if (line.starts_with(begin)) return line;
      }
      pollfd p{out_, POLLIN, 0};
      char some[4096];
      const ssize_t n = ::poll(&p, 1, 20000) > 0 ? ::read(out_, some, sizeof some) : 0;
      if (n <= 0) return {};
      rest_.append(some, static_cast<std::size_t>(n));
    }
  }
  int stop() {
    ::kill(process_, SIGTERM);
    int status = 0;
    ::waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] DicomPeer peer() const {
    DicomPeer p;
    p.ae = "OSTEOTOME";
    p.host = "127.0.0.1";
    p.port = port;
    return p;
  }
  [[nodiscard]] long warned(const std::string& what) const {
    return std::count_if(said.begin(), said.end(), [&](const std::string& s) {
      return s.starts_with("warned") && s.find(what) != std::string::npos;
    });
  }

  int port = 0;
  std::vector<std::string> said;

 private:
  pid_t process_ = -1;
  int out_ = -1;
  std::string rest_;
};

class ReceiveNode : public ::testing::Test {
 protected:
  TemporaryFolder temporary_;
  const fs::path inbox_ = temporary_.path() / "inbox";

  std::vector<fs::path> scan(const std::string& series, int objects, std::size_t bytes) {
    std::vector<fs::path> files;
    for (int i = 0; i < objects; ++i) {
      files.push_back(temporary_.path() / (series + "-" + std::to_string(i) + ".dcm"));
      write_object(files.back(), "1.2.3." + series, "1.2.3." + series + "." + std::to_string(i), bytes);
    }
    return files;
  }
  static std::size_t send(const Node& node, const std::vector<fs::path>& files) {
    return send_objects(node.peer(), list_objects(files).objects, false).accepted();
  }
};

TEST_F(ReceiveNode, AnInboxThatIsEmptiedEachDayIsNeverFull) {
  ReceiveOptions o;
  o.folder_gb = 0.001;
  o.quiet_s = 0.05;
  Node node(inbox_, o);
  ASSERT_GT(node.port, 0);
  const auto files = scan("7", 6, 100'000);
  for (int day = 0; day < 3; ++day) {
    EXPECT_EQ(send(node, files), 6U) << day;
    EXPECT_EQ(node.wait_for("closed 6"), "closed 6");  // a busy machine may make it two
    // All of it, also what the node has made for itself.
    for (const auto& what : fs::directory_iterator(inbox_)) fs::remove_all(what.path());
  }
  // And one that is not: full.
  EXPECT_EQ(send(node, files), 6U);
  EXPECT_EQ(send(node, scan("8", 6, 100'000)), 4U);
  EXPECT_EQ(node.stop(), 0);
}

TEST_F(ReceiveNode, ASeriesThatIsMovedAwayStopsNothing) {
  ReceiveOptions o;
  o.quiet_s = 1;
  Node node(inbox_, o);
  ASSERT_GT(node.port, 0);
  EXPECT_EQ(send(node, scan("7", 2, 100)), 2U);
  fs::rename(inbox_, temporary_.path() / "elsewhere");
  EXPECT_NE(node.wait_for("warned the series").find("moved or deleted"), std::string::npos);
  // While there is no inbox nothing is taken; when there is one again, it goes on.
  EXPECT_EQ(send(node, scan("8", 1, 100)), 0U);
  fs::create_directories(inbox_);
  EXPECT_EQ(send(node, scan("8", 3, 100)), 3U);
  EXPECT_EQ(node.wait_for("closed 3"), "closed 3");
  EXPECT_EQ(node.stop(), 0);
  EXPECT_EQ(node.warned("moved or deleted"), 1);
  EXPECT_EQ(node.warned("the inbox is gone"), 1);
}

TEST_F(ReceiveNode, TwoAtOnce) {
  ReceiveOptions o;
  o.quiet_s = 0.3;
  Node node(inbox_, o);
  ASSERT_GT(node.port, 0);
  // Two peers.
  std::vector<pid_t> peers;
  for (const char* series : {"7", "8"}) {
    const auto files = scan(series, 20, 5000);
    if ((peers.emplace_back(::fork())) == 0) ::_exit(static_cast<int>(send(node, files)));
  }
  for (const pid_t p : peers) {
    int status = 0;
    ::waitpid(p, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 20);
  }
  EXPECT_EQ(node.wait_for("closed 20"), "closed 20");
  EXPECT_EQ(node.wait_for("closed 20"), "closed 20");
  // A second node would clear away what the first is writing.
  Node second(inbox_, o);
  EXPECT_EQ(second.port, 0);
  EXPECT_NE(second.said.at(0).find("another node receives"), std::string::npos);
  EXPECT_EQ(second.stop(), 6);
  // The next one, after one that was stopped, has the folder.
  EXPECT_EQ(node.stop(), 0);
  EXPECT_GT(Node(inbox_, o).port, 0);
}

// A peer that lets a byte fall now and then: at the request, within a command, within an object.
class Dripper {
 public:
  Dripper(int port, std::string all, std::size_t at_once) : all_(std::move(all)), at_(at_once) {
    fd_ = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) std::abort();
    static_cast<void>(::send(fd_, all_.data(), at_, MSG_NOSIGNAL));
  }
  ~Dripper() { ::close(fd_); }
  bool send(const std::string& bytes) const {
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  // What has come behind the first of its units, within two seconds; empty where it has ended.
  std::string answer() const {
    std::string all;
    for (pollfd p{fd_, POLLIN, 0}; ::poll(&p, 1, 2000) > 0;) {
      char some[1024];
      const ssize_t n = ::recv(fd_, some, sizeof some, 0);
      if (n <= 0) return {};
      all.append(some, static_cast<std::size_t>(n));
      const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(all[i])); };
      const std::size_t first = all.size() < 6 ? 0 : 6 + 256 * byte(4) + byte(5);
      if (first > 0 && all.size() > first) return all.substr(first);
    }
    return {};
  }
  // False when the other side has ended.
  bool drip() {
    char answer[1024];
    const ssize_t n = ::recv(fd_, answer, sizeof answer, MSG_DONTWAIT);
    if (n == 0 || (n < 0 && errno != EAGAIN)) return false;
    return ::send(fd_, at_ < all_.size() ? &all_[at_++] : "x", 1, MSG_NOSIGNAL) == 1;
  }

 private:
  std::string all_;
  std::size_t at_;
  int fd_ = -1;
};

std::string big_endian(std::size_t n, int bytes) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += static_cast<char>(n >> (8 * i) & 0xff);
  return text;
}
std::string little_endian(std::size_t n, int bytes) {
  std::string text = big_endian(n, bytes);
  std::reverse(text.begin(), text.end());
  return text;
}
// A-ASSOCIATE-RQ for CT images in implicit little endian.
std::string association_request() {
  const auto item = [](int kind, const std::string& body) {
    return std::string{static_cast<char>(kind), 0} + big_endian(body.size(), 2) + body;
  };
  const std::string items = item(0x10, "1.2.840.10008.3.1.1.1") +
                            item(0x20, std::string("\1\0\0\0", 4) + item(0x30, "1.2.840.10008.5.1.4.1.1.2") +
                                           item(0x40, "1.2.840.10008.1.2")) +
                            item(0x50, item(0x51, big_endian(16384, 4)) + item(0x52, "1.2.3"));
  const std::string titles = "OSTEOTOME       PEER            ";
  const std::string body = big_endian(1, 2) + big_endian(0, 2) + titles + std::string(32, '\0') + items;
  return std::string("\1\0", 2) + big_endian(body.size(), 4) + body;
}
// P-DATA with one piece that says it has `promised` bytes; control 1: command, 2: last.
std::string data_unit(const std::string& what, int control, std::size_t promised) {
  return std::string("\4\0", 2) + big_endian(promised + 6, 4) + big_endian(promised + 2, 4) +
         std::string{1, static_cast<char>(control)} + what;
}
std::string store_request() {
  const auto element = [](std::size_t tag, std::string value) {
    if (value.size() % 2 != 0) value += '\0';
    return little_endian(0, 2) + little_endian(tag, 2) + little_endian(value.size(), 4) + value;
  };
  const std::string fields = element(2, "1.2.840.10008.5.1.4.1.1.2") + element(0x100, little_endian(1, 2)) +
                             element(0x110, little_endian(1, 2)) + element(0x700, little_endian(0, 2)) +
                             element(0x800, little_endian(1, 2)) + element(0x1000, "1.2.3.9");
  const std::string command = element(0, little_endian(fields.size(), 4)) + fields;
  return data_unit(command, 3, command.size());
}

TEST_F(ReceiveNode, WhoDripsIsEndedAfterTheTimeOfAMessage) {
  ReceiveOptions o;
  o.timeout_s = 0.6;
  o.most_associations = 3;
  Node node(inbox_, o);
  ASSERT_GT(node.port, 0);
  const std::string request = association_request(), store = store_request(), pixels = data_unit("", 2, 10'000);
  std::vector<std::unique_ptr<Dripper>> peers;
  peers.push_back(std::make_unique<Dripper>(node.port, request, 20));
  peers.push_back(std::make_unique<Dripper>(node.port, request + store, request.size() + 20));
  peers.push_back(std::make_unique<Dripper>(node.port, request + store + pixels, request.size() + store.size() + 12));
  const auto begin = Clock::now();
  std::vector<bool> held(peers.size(), true);
  double last_s = 0;
  while (Clock::now() - begin < 12s && std::count(held.begin(), held.end(), true) > 0) {
    std::this_thread::sleep_for(50ms);
    for (std::size_t i = 0; i < peers.size(); ++i) held[i] = held[i] && peers[i]->drip();
    last_s = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  EXPECT_EQ(std::count(held.begin(), held.end(), true), 0);
  EXPECT_LT(last_s, 10) << "dripping at 20 bytes a second";
  // The node is free for others, and what was half is away.
  EXPECT_EQ(send(node, scan("7", 2, 1000)), 2U);
  EXPECT_NE(node.wait_for("counts 2 stored").find(" 3 timed out 0 died"), std::string::npos);
  EXPECT_TRUE(fs::is_empty(inbox_ / ".incoming"));
}

// An object that takes longer than a message may, but comes along, is taken in whole.
TEST_F(ReceiveNode, WhatComesAlongMayTakeItsTime) {
  ReceiveOptions o;
  o.timeout_s = 1;
  Node node(inbox_, o);
  ASSERT_GT(node.port, 0);
  Dripper peer(node.port, association_request() + store_request(),
               association_request().size() + store_request().size());
  for (int i = 0; i < 40; ++i) {  // 250 kB a second for 1.6 s
    std::this_thread::sleep_for(40ms);
    ASSERT_TRUE(peer.send(data_unit(std::string(10'000, 'x'), 0, 10'000))) << i;
  }
  ASSERT_TRUE(peer.send(data_unit("xx", 2, 2)));
  // It says what it thinks of it, in P-DATA behind its A-ASSOCIATE-AC.
  const std::string answer = peer.answer();
  EXPECT_EQ(answer.substr(0, 1), "\4");
  EXPECT_NE(node.wait_for("counts 0 stored").find(" 0 timed out"), std::string::npos);
}

}  // namespace
}  // namespace osteo
