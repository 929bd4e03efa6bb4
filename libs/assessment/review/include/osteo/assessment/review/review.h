// A session as a page that a person reads: what was found, where it can be seen, how it went over time, and beside whom
// it stands.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/findings.h"
#include "osteo/assessment/evidence/timeline.h"
#include "osteo/core/base/context.h"
#include "osteo/core/report/sheet.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo::inline assessment {

struct ReviewRequest {
  std::filesystem::path session;
  std::filesystem::path case_folder;  ///< where the case is now; empty: as the session says
  std::optional<Procedure> procedure;
  std::filesystem::path reference;             ///< folder with reference.json; empty: none
  std::string subject;                         ///< sessions of the reference by this one are left out
  std::vector<std::filesystem::path> earlier;  ///< earlier sessions of the same person on this case, in their order
  bool pictures = true;                        ///< false: no rendering (then no OpenGL is needed), the page says so
};

/// A figure beside the same of others.
struct Comparison {
  const MetricRow* row = nullptr;
  std::optional<double> value;
  std::vector<std::optional<double>> earlier;  ///< in their order
  std::vector<double> experts, novices;        ///< of the reference
};

/// Force by distance to one structure: steps of 0.1 mm.
struct ForceProfile {
  std::string structure;
  double drilled_s = 0;                                               ///< near it
  std::vector<IsotonicQuantile::Point> middle, most;                  ///< half of the samples are below, nine in ten
  std::vector<IsotonicQuantile::Point> experts_middle, experts_most;  ///< empty: no reference
  std::vector<std::array<float, 2>> samples;  ///< distance, force; at most kMaxSamples, evenly chosen
  static constexpr std::size_t kMaxSamples = 1500;
};

/// Triangles in 16 bits a coordinate, for the 3D view of the page.
struct ReviewMesh {
  std::string id, name;
  std::array<std::uint8_t, 3> rgb{};
  TriMesh mesh;
};

struct ReviewPicture {
  std::string id;       ///< "before", "after", "unseen", "unseen-side", or that of a finding
  std::string caption;  ///< also what is read aloud
  Picture picture;
  std::string shown = {};  ///< the caption in the language of the page
};

/// The texts of a review in the language of its page and paper; its own are English, as its JSON has them.
struct ReviewTexts {
  std::vector<std::string> labels, left_out;
  Findings findings;
};

/// All that the page, the PDF and the JSON say.
struct Review {
  std::vector<std::string>
      labels;  ///< what has to be known before all else: made by a script, under guidance, cut short, ...
  std::string procedure;
  Score score;
  Findings findings;
  Timeline timeline;
  std::vector<Comparison> comparison;
  std::size_t earlier = 0, experts = 0, novices = 0;  ///< sessions compared with
  std::vector<ForceProfile> profiles;
  std::vector<ReviewMesh> meshes;
  Vec3 view_centre_mm, view_eye{1, 0, 0};  ///< of the 3D view, at first
  double view_radius_mm = 30;
  std::vector<ReviewPicture> pictures;
  std::vector<std::string> left_out;  ///< what the page lacks, and why
  ReviewTexts shown;
  double hidden_mm3 = 0, seen_mm3 = 0, unknown_mm3 = 0;
  bool damaged = false;  ///< the session's file is

  std::shared_ptr<const Procedure> of_procedure;  ///< that the items of the score refer to; null: none
};

/// Reads, scores, compares and draws. Errors: as open_session_folder, load_case, score_session, load_reference; failed
/// without OpenGL. Cost: docs/how-to/review.md.
[[nodiscard]] Review make_review(const ReviewRequest& request, const Context& context = {});

/// "osteotome_review": 1. All that the page says, and the voxels and places that prove it.
[[nodiscard]] Json review_json(const Review& review);
/// In the language that is used, which is the one that the review was made in. Self-contained: pictures, meshes, script
/// and style inside; asks for nothing from anywhere. Same review, same language, same bytes.
[[nodiscard]] std::string review_html(const Review& review);
[[nodiscard]] Sheet review_sheet(const Review& review);

/// review.html, review.pdf and review.json into a folder that is made for them, whole or not at all.
/// Error(cannot_write) where it exists and is not empty, unless `force` and it holds nothing but an earlier review.
void may_write_review(const std::filesystem::path& folder, bool force);  ///< throws as write_review would
void write_review(const Review& review, const std::filesystem::path& folder, bool force);

}  // namespace osteo::inline assessment
