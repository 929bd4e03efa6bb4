#include "osteo/imaging/edit/detail/operation.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline imaging {
namespace {

template <class E>
struct Described {
  using Params = E;
  static void describe(E& p, auto& visit) { E::describe(p, visit); }
};

std::string number(double v) {
  return format_number(std::round(v * 100) / 100);
}

void require_colour(const std::vector<int>& rgb) {
  if (rgb.size() != 3 || *std::min_element(rgb.begin(), rgb.end()) < 0 ||
      *std::max_element(rgb.begin(), rgb.end()) > 255)
    throw Error(ExitCode::usage, "a colour has three numbers from 0 to 255");
}
void require_name(const std::string& name) {
  if (name.empty()) throw Error(ExitCode::usage, "a structure needs a name");
  if (name.size() > 64 || name.find_first_of("\n\r\t\\\"") != std::string::npos)
    throw Error(ExitCode::usage, "the name of a structure has at most 64 characters, no quotes, tabs and line ends");
}

struct Check {
  void operator()(const ThresholdEdit& o) const {
    if (o.lower_hu > o.upper_hu) throw Error(ExitCode::usage, "a threshold's lower value is above its upper one");
  }
  void operator()(const BoxEdit& o) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (o.lo_mm[a] > o.hi_mm[a]) throw Error(ExitCode::usage, "the corners of a box are in the wrong order");
    }
  }
  void operator()(const BrushEdit& o) const {
    if (o.points_mm.empty()) throw Error(ExitCode::usage, "a brush needs a point");
    for (const Vec3 p : o.points_mm) {
      for (std::size_t a = 0; a < 3; ++a) {
        if (!(std::abs(p[a]) <= 1e6))
          throw Error(ExitCode::usage, "a point of a brush lies more than a kilometre away");
      }
    }
  }
  void operator()(const AddStructureEdit& o) const {
    require_name(o.name);
    require_colour(o.rgb);
  }
  void operator()(const ChangeStructureEdit& o) const {
    require_name(o.name);
    require_colour(o.rgb);
  }
  void operator()(const auto&) const {}
};

}  // namespace

std::string_view operation_name(const EditOperation& operation) {
  return std::visit([](const auto& o) { return std::decay_t<decltype(o)>::kName; }, operation);
}

std::string operation_text(const EditOperation& operation) {
  struct Text {
    std::string operator()(const ThresholdEdit& o) const {
      return "threshold from " + number(o.lower_hu) +
             (o.upper_hu < 32767 ? " to " + number(o.upper_hu) : std::string()) + " HU";
    }
    std::string operator()(const IslandEdit& o) const {
      return o.choice == IslandChoice::remove ? "piece removed" : "one piece kept";
    }
    std::string operator()(const IslandSizeEdit& o) const {
      return o.keep_largest > 0 ? "largest " + std::to_string(o.keep_largest) + " components kept"
                                : "components below " + number(o.min_volume_mm3) + " mm3 removed";
    }
    std::string operator()(const BoxEdit& o) const {
      return o.choice == BoxChoice::keep_inside ? "kept inside a box" : "box cleared";
    }
    std::string operator()(const FillEdit& o) const {
      return "cavities up to " + number(o.max_volume_mm3) + " mm3 filled";
    }
    std::string operator()(const SmoothEdit& o) const { return "smoothed within " + number(o.radius_mm) + " mm"; }
    std::string operator()(const BrushEdit& o) const {
      return std::string(o.erase ? "eraser " : "brush ") + number(2 * o.radius_mm) + " mm" +
             (o.structure > 0 ? " on structure " + std::to_string(o.structure) : std::string());
    }
    std::string operator()(const VoxelsEdit& o) const { return "voxels of structure " + std::to_string(o.structure); }
    std::string operator()(const AddStructureEdit& o) const { return "structure '" + o.name + "' added"; }
    std::string operator()(const ChangeStructureEdit& o) const { return "structure '" + o.name + "' changed"; }
    std::string operator()(const DeleteStructureEdit& o) const {
      return "structure " + std::to_string(o.structure) + " deleted";
    }
  };
  return std::visit(Text{}, operation);
}

std::vector<FieldRef> operation_fields(EditOperation& operation) {
  return std::visit([](auto& o) { return fields_of<Described<std::decay_t<decltype(o)>>>(o); }, operation);
}

bool changes_bone(const EditOperation& operation) {
  if (const auto* const brush = std::get_if<BrushEdit>(&operation)) return brush->structure == 0;
  return operation.index() <= 5;
}

void require_valid(const EditOperation& operation) {
  EditOperation copy = operation;
  for (const FieldRef& f : operation_fields(copy)) f.from_text(f.to_text(), f.doc.name);  // ranges
  std::visit(Check{}, operation);
}

}  // namespace osteo::inline imaging
