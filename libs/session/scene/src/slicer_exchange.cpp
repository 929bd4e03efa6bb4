#include "osteo/session/scene/slicer_exchange.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/io/segments.h"
#include "osteo/imaging/io/volume_io.h"
#include "osteo/session/scene/recipe.h"

namespace osteo::inline session {
namespace {

const std::string kBone = "bone";

// The stages that a correction is about.
struct Parts {
  const PipelineNode* bone = nullptr;
  const PipelineNode* mask = nullptr;  // none where a file is the mask
  const PipelineNode* ct = nullptr;
};

Parts parts_of(const Pipeline& pipeline) {
  const auto node = [&](const std::string& id) -> const PipelineNode* {
    for (const PipelineNode& n : pipeline.nodes) {
      if (!id.empty() && n.id == id) return &n;
    }
    return nullptr;
  };
  Parts parts;
  for (const PipelineNode& n : pipeline.nodes) {
    if (n.stage != "resample" || parts.bone != nullptr) continue;
    const auto image = n.inputs.find("image"), mask = n.inputs.find("mask");
    if (image == n.inputs.end() || mask == n.inputs.end()) continue;
    parts = {&n, node(mask->second.node), node(image->second.node)};
  }
  if (parts.bone == nullptr || parts.ct == nullptr) {
    throw Error(ExitCode::usage, "the case's pipeline '" + pipeline.name + "' makes its bone without a mask",
                "make the case with the built-in pipeline, or one with the stages threshold and resample");
  }
  return parts;
}

// Where the voxels of one lattice are on another; whether they fall on voxels there.
struct Onto {
  const Frame &to, &from;
  bool aligned = true;

  Onto(const Frame& to_frame, const Frame& from_frame) : to(to_frame), from(from_frame) {
    const Vec3 zero = from.index_from_world(to.world_from_index({0, 0, 0}));
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 far{};
      far[a] = to.dims[a] - 1;
      const Vec3 there = from.index_from_world(to.world_from_index(far));
      for (std::size_t b = 0; b < 3; ++b) {
        const double step = there[b] - zero[b], wanted = a == b ? far[a] : 0;
        aligned = aligned && std::abs(zero[b] - std::round(zero[b])) < 0.02 && std::abs(step - wanted) < 0.02;
      }
    }
  }

  // Calls f(voxel of `to`) for each whose centre lies in a voxel of `from` that is 1.
  template <class F>
  void each(const std::uint8_t* mask, F&& f) const {
    Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (int corner = 0; corner < 8; ++corner) {
      Vec3 c;
      for (std::size_t a = 0; a < 3; ++a) c[a] = (corner >> a & 1) != 0 ? from.dims[a] - 0.5 : -0.5;
      const Vec3 x = to.index_from_world(from.world_from_index(c));
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], x[a]);
        hi[a] = std::max(hi[a], x[a]);
      }
    }
    std::array<int, 3> begin, end;
    for (std::size_t a = 0; a < 3; ++a) {
      begin[a] = static_cast<int>(std::clamp(std::floor(lo[a]), 0.0, static_cast<double>(to.dims[a])));
      end[a] = static_cast<int>(std::clamp(std::ceil(hi[a]) + 1, 0.0, static_cast<double>(to.dims[a])));
    }
    const Vec3 origin = from.index_from_world(to.world_from_index({0, 0, 0}));
    Vec3 step[3];
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 one{};
      one[a] = 1;
      step[a] = from.index_from_world(to.world_from_index(one)) - origin;
    }
    const auto nx = static_cast<std::size_t>(from.dims[0]), ny = static_cast<std::size_t>(from.dims[1]);
    for (int k = begin[2]; k < end[2]; ++k) {
      for (int j = begin[1]; j < end[1]; ++j) {
        const Vec3 row = origin + step[1] * j + step[2] * k;
        for (int i = begin[0]; i < end[0]; ++i) {
          const Vec3 x = row + step[0] * i;
          std::array<int, 3> at;
          bool in = true;
          for (std::size_t a = 0; a < 3; ++a) {
            at[a] = static_cast<int>(std::floor(x[a] + 0.5));
            in = in && at[a] >= 0 && at[a] < from.dims[a];
          }
          if (!in) continue;
          const std::size_t v = (static_cast<std::size_t>(at[2]) * ny + static_cast<std::size_t>(at[1])) * nx +
                                static_cast<std::size_t>(at[0]);
          if (mask[v] == 0) continue;
          f((static_cast<std::size_t>(k) * static_cast<std::size_t>(to.dims[1]) + static_cast<std::size_t>(j)) *
                static_cast<std::size_t>(to.dims[0]) +
            static_cast<std::size_t>(i));
        }
      }
    }
  }
};

std::string percent(double share) {
  return format_number(std::round(share * 1000) / 10) + " %";
}

// What drew it, as its tag says; what was changed since says so.
std::string origin_of(const Segment& s, const SegmentChange& c) {
  const auto tag = s.tags.find(std::string(kOriginTag));
  if (tag == s.tags.end() || tag->second.empty()) return {};
  const bool same = c.added_mm3 == 0 && c.removed_mm3 == 0;
  return tag->second + (same || tag->second.ends_with(kCorrectedByHand) ? "" : std::string(kCorrectedByHand));
}

std::string known_as(const Segment& s) {
  const auto tag = s.tags.find(std::string(kStructureTag));
  return tag == s.tags.end() ? tag_value(s.name) : tag->second;
}

// What comes back, each file by itself: segments in place, and which were there before.
class Taker {
 public:
  Taker(const CaseImages& images, const SlicerImportOptions& options, const Context& context)
      : images_(images), options_(options), context_(context) {}

  SlicerImport run(const fs::path& folder) {
    read(folder);
    require_same_scan(folder);
    SlicerImport back;
    if (bone_ != nullptr) take_bone(back);
    if (!structures_.empty() || structures_came_) take_structures(back);
    return back;
  }

 private:
  void read(const fs::path& folder) {
    std::vector<fs::path> files;
    if (fs::is_directory(folder)) {
      for (const auto& e : fs::directory_iterator(folder)) {
        if (e.is_regular_file() && lower_case(e.path().filename().string()).ends_with(".seg.nrrd"))
          files.push_back(e.path());
      }
      std::sort(files.begin(), files.end());
    } else {
      require_readable(folder);
      files.push_back(folder);
    }
    if (files.empty()) {
      throw Error(ExitCode::no_input, "'" + folder.string() + "' holds no segmentation (.seg.nrrd)",
                  "save the segmentations there from 3D Slicer, with their names");
    }
    for (const fs::path& file : files) {
      std::vector<Segment> segments = load_segments(file, context_);
      const bool only_bone = segments.size() == 1 && known_as(segments.front()) == kBone;
      structures_came_ = structures_came_ || !only_bone;
      for (Segment& s : segments) all_.push_back(std::move(s));
    }
    std::set<std::string> names;
    for (const Segment& s : all_) {
      if (known_as(s) == kBone && bone_ == nullptr) {
        bone_ = &s;
      } else {
        structures_.push_back(&s);
      }
      if (!names.insert(s.name).second) {
        throw Error(ExitCode::corrupt, "there are two segments '" + s.name + "'",
                    "which one is meant? Delete or rename one; a copy of a file in the folder counts as well");
      }
    }
    if (structures_.size() > 255) throw Error(ExitCode::corrupt, "there are more than 255 structures");
  }

  void require_same_scan(const fs::path& folder) const {
    bool marked = false;
    for (const Segment& s : all_) {
      const auto tag = s.tags.find(std::string(kScanTag));
      if (tag == s.tags.end()) continue;
      if (tag->second != images_.mark) {
        throw Error(
            ExitCode::corrupt,
            "the segment '" + s.name + "' was drawn on another scan than that of the case, or on another part of it",
            "import it into the case that was exported; where the case's region was changed since, export it "
            "again");
      }
      marked = true;
    }
    if (marked) return;
    const fs::path ct = fs::is_directory(folder) ? folder / "ct.nrrd" : folder.parent_path() / "ct.nrrd";
    if (fs::exists(ct)) {
      if (scan_mark(load_image(ct, context_)) == images_.mark) return;
      throw Error(ExitCode::corrupt, "'ct.nrrd' beside the segments holds other voxels than the scan of the case",
                  "take it back into the case that was handed over");
    }
    if (!options_.match_by_position || bone_ == nullptr) {
      throw Error(
          ExitCode::corrupt,
          "it is not known of which scan these segments are: they bear no mark, and no ct.nrrd lies beside them",
          "put the ct.nrrd of 'osteo export-slicer' beside them, or give --match-by-position, which goes by "
          "where the bone lies");
    }
  }

  // The segment on a lattice; how much of it lies outside.
  std::vector<std::uint8_t> placed(const Segment& s, const Frame& on) {
    std::vector<std::uint8_t> voxels(on.voxel_count());
    if (!s.mask) return voxels;
    const Onto onto(on, s.mask->frame);
    if (!onto.aligned && resampled_.insert(s.name).second) {
      context_.warn("'" + s.name + "' lies on other voxels than the CT; it is taken to the nearest ones");
    }
    double inside = 0, all = 0;
    onto.each(s.mask->voxels.get(), [&](std::size_t v) {
      voxels[v] = 1;
      inside += 1;
    });
    for (const std::uint8_t v : s.mask->span()) all += v;
    inside *= on.voxel_volume_mm3();
    all *= s.mask->frame.voxel_volume_mm3();
    if (inside <= 0 && all > 0 && (onto.aligned || all > 8 * on.voxel_volume_mm3())) {
      throw Error(ExitCode::corrupt, "'" + s.name + "' lies outside the scan of the case",
                  "it is of another scan, or was moved: look at both in 3D Slicer");
    }
    if (inside < 0.9 * all)
      context_.warn(percent(1 - inside / all) + " of '" + s.name +
                    "' stick out of the scan, or are too fine for it, and are lost");
    return voxels;
  }

  static SegmentChange compare(const std::uint8_t* before, const std::uint8_t* after, std::size_t n, double voxel_mm3) {
    std::size_t was = 0, is = 0, both = 0;
    for (std::size_t v = 0; v < n; ++v) {
      was += before[v];
      is += after[v];
      both += before[v] & after[v];
    }
    const auto mm3 = [&](std::size_t count) { return static_cast<double>(count) * voxel_mm3; };
    SegmentChange c;
    c.before_mm3 = mm3(was);
    c.after_mm3 = mm3(is);
    c.added_mm3 = mm3(is - both);
    c.removed_mm3 = mm3(was - both);
    return c;
  }

  void take_bone(SlicerImport& back) {
    const Frame& frame = images_.ct.frame;
    const auto after = placed(*bone_, frame);
    std::vector<std::uint8_t> before(frame.voxel_count());
    for (std::size_t v = 0; v < before.size(); ++v) before[v] = images_.bone.voxels[v] != 0 ? 1 : 0;
    SegmentChange c = compare(before.data(), after.data(), before.size(), frame.voxel_volume_mm3());
    c.name = bone_->name;
    c.was = kBone;
    c.is_bone = true;
    const double kept = c.before_mm3 > 0 ? 1 - c.removed_mm3 / c.before_mm3 : 1;
    if (c.after_mm3 <= 0)
      throw Error(ExitCode::corrupt, "the bone that comes back is empty", "was it saved with its segment shown?");
    if (kept < 0.5) {
      throw Error(
          ExitCode::corrupt,
          "only " + percent(kept) + " of the bone lie where they were: it was moved, mirrored, or is of another scan",
          "look at the CT of the case and the segment together in 3D Slicer");
    }
    auto voxels = make_voxels<std::uint8_t>(after.size());
    std::copy(after.begin(), after.end(), voxels.get());
    back.bone = Labels{{frame, std::move(voxels)}, {{1, kBone, {241, 214, 145}}}};
    back.bone_changed = c.added_mm3 > 0 || c.removed_mm3 > 0;
    back.changes.push_back(std::move(c));
  }

  // Structures stay on the lattice they had, as long as all that come back lie on it.
  const Frame& frame_of_structures() const {
    if (!images_.structures) return images_.ct.frame;
    const Frame& own = images_.structures->frame;
    const bool fit = std::all_of(structures_.begin(), structures_.end(),
                                 [&](const Segment* s) { return !s->mask || Onto(own, s->mask->frame).aligned; });
    return fit ? own : images_.ct.frame;
  }

  void take_structures(SlicerImport& back) {
    const Frame& frame = frame_of_structures();
    const std::size_t n = frame.voxel_count();
    struct Old {
      std::string name;
      std::vector<std::uint8_t> mask;
    };
    std::map<std::string, Old> before;  // by what their tags say
    if (images_.structures) {
      const Labels& old = *images_.structures;
      const Onto onto(frame, old.frame);
      for (const Structure& s : old.structures) {
        std::vector<std::uint8_t> one(old.frame.voxel_count());
        for (std::size_t v = 0; v < one.size(); ++v) one[v] = old.voxels[v] == s.value ? 1 : 0;
        Old& kept = before[tag_value(s.name)];
        kept.name = s.name;
        kept.mask.resize(n);
        onto.each(one.data(), [&](std::size_t v) { kept.mask[v] = 1; });
      }
    }
    auto voxels = make_voxels<std::uint8_t>(n);
    std::fill_n(voxels.get(), n, std::uint8_t{0});
    Labels labels;
    const std::vector<std::uint8_t> none(n);
    std::size_t overlap = 0;
    for (const Segment* s : structures_) {
      const auto after = placed(*s, frame);
      const auto old = before.find(known_as(*s));
      SegmentChange c = compare(old == before.end() ? none.data() : old->second.mask.data(), after.data(), n,
                                frame.voxel_volume_mm3());
      c.name = s->name;
      if (old != before.end()) {
        c.was = old->second.name;
        before.erase(old);
      }
      if (c.after_mm3 > 0) {
        const auto value = static_cast<std::uint8_t>(labels.structures.size() + 1);
        labels.structures.push_back({value, s->name, s->rgb, origin_of(*s, c)});
        if (c.added_mm3 == 0 && c.removed_mm3 == 0) read_certainty(s->tags, labels.structures.back());
        for (std::size_t v = 0; v < n; ++v) {
          if (after[v] == 0) continue;
          overlap += voxels[v] != 0 ? 1 : 0;
          voxels[v] = value;
        }
      } else {
        context_.warn("'" + s->name + "' came back empty and is left out");
        c.name.clear();
      }
      back.changes.push_back(std::move(c));
    }
    for (const auto& [tag, kept] : before) {
      SegmentChange c = compare(kept.mask.data(), none.data(), n, frame.voxel_volume_mm3());
      c.was = kept.name;
      back.changes.push_back(std::move(c));
    }
    if (overlap > 0)
      context_.warn(std::to_string(overlap) + " voxels belong to several structures; the last one keeps them");
    back.structures_changed = std::any_of(back.changes.begin(), back.changes.end(),
                                          [](const SegmentChange& c) { return !c.is_bone && c.changed(); });
    labels.frame = frame;
    labels.voxels = std::move(voxels);
    back.structures = std::move(labels);
  }

  const CaseImages& images_;
  const SlicerImportOptions& options_;
  const Context& context_;
  std::vector<Segment> all_;
  const Segment* bone_ = nullptr;
  std::vector<const Segment*> structures_;
  bool structures_came_ = false;
  std::set<std::string> resampled_;
};

}  // namespace

std::string scan_mark(const Image& ct) {
  Hasher hasher;
  hasher.add(ct.frame.dims.data(), sizeof(int) * 3);
  hasher.add(ct.voxels.get(), ct.frame.voxel_count() * sizeof(std::int16_t));
  return hasher.hex();
}

CaseImages images_of_case(const CasePipeline& from, const fs::path& case_folder, const Registry& registry,
                          const Context& context) {
  Pipeline pipeline = parse_pipeline(from.text, from.settings);
  const Parts parts = parts_of(pipeline);
  const TemporaryFolder scratch;
  const fs::path ct_file = scratch.path() / "ct.nrrd", mask_file = scratch.path() / "mask.nrrd";
  const std::string ct_id = parts.ct->id, mask_id = parts.mask == nullptr ? std::string() : parts.mask->id;
  const auto mask_input = parts.bone->inputs.at("mask");
  // Only what leads to the two.
  std::set<std::string> wanted{ct_id};
  if (!mask_id.empty()) wanted.insert(mask_id);
  for (bool more = true; more;) {
    more = false;
    for (const PipelineNode& n : pipeline.nodes) {
      if (!wanted.contains(n.id)) continue;
      for (const auto& [port, input] : n.inputs)
        more = (!input.node.empty() && wanted.insert(input.node).second) || more;
    }
  }
  std::erase_if(pipeline.nodes, [&](const PipelineNode& n) { return !wanted.contains(n.id); });
  for (PipelineNode& n : pipeline.nodes) {
    n.outputs.clear();
    if (n.id == ct_id) n.outputs["image"] = ct_file;
    if (n.id == mask_id) n.outputs["mask"] = mask_file;
  }
  static_cast<void>(run_pipeline(std::move(pipeline), registry, {}, context));
  CaseImages images;
  images.ct = load_image(ct_file, context);
  images.bone = load_labels(mask_id.empty() ? mask_input.file : mask_file, context);
  images.bone.structures = {{1, kBone, {241, 214, 145}}};
  const fs::path structures = case_folder / "structures.seg.nrrd";
  if (fs::exists(structures)) images.structures = load_labels(structures, context);
  images.mark = scan_mark(images.ct);
  return images;
}

void export_slicer(const CaseImages& images, const fs::path& folder) {
  const auto must_be_empty = [&](const fs::path& old) {
    throw Error(ExitCode::cannot_write, "'" + old.string() + "' is not empty",
                "give a new folder: what was edited there is not written over");
  };
  const std::map<std::string, std::string> tags{{std::string(kScanTag), images.mark}};
  write_folder_atomically(folder, must_be_empty, [&](const fs::path& to) {
    save_image(images.ct, to / "ct.nrrd");
    save_segments(images.bone, to / "bone.seg.nrrd", tags);
    if (images.structures) save_segments(*images.structures, to / "structures.seg.nrrd", tags);
  });
}

SlicerImport import_slicer(const CaseImages& images, const fs::path& folder, const SlicerImportOptions& options,
                           const Context& context) {
  return Taker(images, options, context).run(folder);
}

std::optional<fs::path> pipeline_file(const fs::path& case_folder, const std::string& hash) {
  if (auto path = recall_file(hash)) return path;
  const fs::path own = case_folder / kCorrectedPipeline;
  std::error_code ec;
  if (fs::is_regular_file(own, ec) && hash_path(own) == hash) return own;
  return std::nullopt;
}

std::string with_corrected_bone(const CasePipeline& from) {
  const Pipeline pipeline = parse_pipeline(from.text, from.settings);
  const Parts parts = parts_of(pipeline);
  const std::string mask_id = parts.mask == nullptr ? std::string() : parts.mask->id;
  std::string lower;
  if (parts.mask != nullptr && parts.mask->stage == "threshold" && !parts.bone->params.contains("lower")) {
    const auto preset = parts.mask->params.find("preset"), at = parts.mask->params.find("lower");
    if (at != parts.mask->params.end() && (preset == parts.mask->params.end() || preset->second == "fixed"))
      lower = at->second;
  }
  const std::optional<Json> old = Json::parse(from.text);
  if (!old) throw Error(ExitCode::corrupt, "the case's pipeline is not JSON");
  // The same text, with the stage of the mask gone and its readers pointed to the file.
  Json made = Json::object();
  for (const Json::Member& m : old->members()) {
    if (m.key != "stages") {
      made[m.key] = m.value;
      continue;
    }
    made["stages"] = Json::list();
    for (const Json& stage : m.value.items()) {
      const Json* const id = stage.find("id");
      const std::string name = id != nullptr && id->text() != nullptr ? *id->text() : "";
      if (!mask_id.empty() && name == mask_id) continue;
      Json copy = stage;
      if (const Json* const in = stage.find("in")) {
        for (const Json::Member& port : in->members()) {
          const std::string* const node = port.value.text();
          const bool of_mask =
              !mask_id.empty() && node != nullptr && (*node == mask_id || node->starts_with(mask_id + "."));
          if (of_mask || (name == parts.bone->id && port.key == "mask"))
            copy["in"][port.key] = Json{{"file", "${case}/" + std::string(kCorrectedBone)}};
        }
      }
      if (name == parts.bone->id && !lower.empty()) copy["params"]["lower"] = lower;
      made["stages"].push_back(std::move(copy));
    }
  }
  return made.dump(2) + "\n";
}

}  // namespace osteo::inline session
