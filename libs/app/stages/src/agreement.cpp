#include "agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/display/view/slices.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::inline app {
namespace {

constexpr std::uint8_t kUncertain = 4;  // of NetworkLabels::uncertainty: the last class
constexpr std::uint8_t kDiffers = 255;

std::string in_tenths(double mm) {
  return format_number(std::round(mm * 10) / 10);
}

std::string words_of(const DifferingPlace& place) {
  return in_tenths(place.apart_mm) + " mm apart over " + in_tenths(place.along_mm) + " mm at " +
         place_text(place.at_mm) + " mm";
}

class Joining {
 public:
  Joining(NetworkLabels& found, EarComparison compared) : found_(found), compared_(std::move(compared)) {}

  void run() {
    found_.structures.voxels = compared_.fused.voxels;
    if (found_.uncertainty.voxels != nullptr) join_classes();
    for (const ComparedStructure& c : compared_.structures) doubt(c);
  }
  [[nodiscard]] const EarComparison& compared() const { return compared_; }

 private:
  // A place that both draw apart is in the last class, whatever the network says of it.
  void join_classes() {
    const std::size_t n = found_.structures.frame.voxel_count();
    const auto classes = make_voxels<std::uint8_t>(n);
    std::copy_n(found_.uncertainty.voxels.get(), n, classes.get());
    for (std::size_t v = 0; v < n; ++v) {
      if (classes[static_cast<std::ptrdiff_t>(v)] == 0 && compared_.apart[v] == 0) continue;
      auto& count = counts_[found_.structures.voxels[v]];
      count[0] += 1;
      if (compared_.apart[v] != kDiffers) continue;
      classes[static_cast<std::ptrdiff_t>(v)] = kUncertain;
      count[1] += 1;
    }
    found_.uncertainty.voxels = classes;
  }

  void doubt(const ComparedStructure& c) {
    for (Structure& s : found_.structures.structures) {
      if (std::find(c.values.begin(), c.values.end(), s.value) == c.values.end()) continue;
      std::string why;
      if (!c.labelled && c.found && c.values.size() == 1) why = "drawn by find-structures alone";
      if (c.labelled && !c.places.empty()) why = "differs from find-structures, " + words_of(c.places.front());
      if (why.empty()) continue;
      s.doubt += (s.doubt.empty() ? "" : "; ") + why;
      // More than the 5 % that may lie farther away do.
      if (const auto& count = counts_[s.value]; 20 * count[1] > count[0] && s.within_mm > 0)
        s.within_mm = std::numeric_limits<double>::infinity();
    }
  }

  NetworkLabels& found_;
  EarComparison compared_;
  std::array<std::array<std::size_t, 2>, 256> counts_{};  // of a structure's boundary: all, and what differs
};

}  // namespace

void join_with_exact(const Image& ct, NetworkLabels& found, const Context& context) {
  EarComparison compared;
  try {
    compared = compare_with_ear(ct, found.structures, context);
  } catch (const std::exception& e) {
    // What the network has found stays, whatever a comparison runs into.
    if (const auto* const error = dynamic_cast<const Error*>(&e);
        error != nullptr && error->code() == ExitCode::cancelled)
      throw;
    context.warn(std::string("the network's structures were not compared with find-structures: ") + e.what());
    return;
  }
  Joining joining(found, std::move(compared));
  const std::vector<ComparedStructure>& all = joining.compared().structures;
  if (all.empty()) return;
  joining.run();
  std::string agree, differ, one;
  const auto add = [](std::string& to, const std::string& text) { to += (to.empty() ? "" : "; ") + text; };
  for (const ComparedStructure& c : all) {
    if (c.labelled && c.found && c.places.empty()) {
      add(agree, c.name + " within " + in_tenths(c.within_mm) + " mm of find-structures");
    } else if (c.labelled && c.found) {
      std::string text = c.name + " differs from find-structures: " + words_of(c.places.front());
      if (c.places.size() > 1) text += ", and at " + std::to_string(c.places.size() - 1) + " more places";
      add(differ, text);
    } else {
      add(one, c.name + (c.labelled ? " by the network alone (" + c.why + ")"
                         : c.found  ? " by find-structures alone"
                                    : " by neither (" + c.why + ")"));
    }
  }
  if (!agree.empty()) context.report("agreement", agree);
  if (!differ.empty()) {
    context.report("disagreement", differ);
    context.warn("two methods disagree: " + differ);
  }
  if (!one.empty()) context.report("found_by_one", one);
}

}  // namespace osteo::inline app
