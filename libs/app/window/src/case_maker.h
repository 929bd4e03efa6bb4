// Cases that are made while the start page goes on, by the 'osteo' program in a process of its own: of a scan as 'osteo
// prepare' makes them, and the demo ear, a phantom. Private to libs/app/window; no screen of its own.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace osteo::inline app {

class CaseMaker {
 public:
  /// `program`: 'osteo'; empty or not there: nothing can be made.
  explicit CaseMaker(std::filesystem::path program) : program_(std::move(program)) {}
  ~CaseMaker() { close(); }
  CaseMaker(const CaseMaker&) = delete;
  CaseMaker& operator=(const CaseMaker&) = delete;
  /// Of the demo: in XDG_DATA_HOME/osteotome/demo, else ~/.local/share/osteotome/demo; empty where neither is set.
  [[nodiscard]] static std::filesystem::path demo_case();
  /// Beside the scan, NAME-case; with a number where that is there.
  [[nodiscard]] static std::filesystem::path case_beside(const std::filesystem::path& scan);

  [[nodiscard]] bool can_make() const;
  /// Empty, or why it cannot be made. One at a time: no-op while another is being made.
  std::string make_demo();
  /// `network`: of a trained network that finds its structures; empty: none.
  std::string make(const std::filesystem::path& scan, const std::filesystem::path& the_case,
                   const std::filesystem::path& network = {});
  /// That is being made; empty: none.
  [[nodiscard]] const std::filesystem::path& making() const { return making_; }
  /// 0 to 1, of all of it.
  [[nodiscard]] double share() const { return share_; }

  struct Made {
    std::filesystem::path the_case;
    std::string why;  ///< empty: it is there
  };
  /// Once, when it has ended. Waits for nothing.
  [[nodiscard]] std::optional<Made> poll();

 private:
  std::string start(const char* script, std::vector<std::string> words, double first_share);
  void close();
  void read_on();
  std::filesystem::path program_, making_;
  pid_t process_ = -1;
  int from_ = -1;
  std::string said_;
  double share_ = 0, first_share_ = 0;  // of the time, what comes before 'prepare'
};

}  // namespace osteo::inline app
