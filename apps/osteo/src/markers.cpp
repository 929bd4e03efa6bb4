// A webcam and a printed marker as the drill: pages to print, camera and pen calibrated, a try without a window.
#include <cmath>
#include <ostream>
#include <vector>

#include "commands/calibrate_camera.h"
#include "commands/calibrate_pen.h"
#include "commands/markers.h"
#include "commands/track_pen.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/rt/loop.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/marker/device.h"
#include "osteo/simulation/marker/sheet.h"

namespace osteo {
namespace {

std::string rounded(double value, double steps) {
  return format_number(std::round(value * steps) / steps);
}

void refuse_to_replace(const fs::path& path, const cli::Invocation& io) {
  if (output_exists(path) && !io.common.force)
    throw Error(ExitCode::cannot_write, "'" + path.string() + "' exists already", "--force replaces it");
}

// From a camera as long as `seconds`, or until interrupted; from files all there are. `each` returns false when it has
// enough.
void look_at_all(const std::string& from, const CameraModel& wish, double seconds, cli::Invocation& io,
                 const auto& each) {
  const auto source = open_pictures(from, wish.width, wish.height, wish.fps);
  const std::int64_t begin = monotonic_ns();
  GrayPicture picture;
  std::uint64_t number = 0;
  while (!io.context.cancelled()) {
    const double past_s = static_cast<double>(monotonic_ns() - begin) / 1e9;
    if (source->live() && past_s > seconds) return;
    if (!source->next(picture)) {
      if (source->live()) throw Error(ExitCode::cannot_read, "the camera is gone", "plug it in again");
      return;
    }
    const double fps = source->fps() > 0 ? source->fps() : 30;
    const double time_s = source->live() ? past_s : static_cast<double>(number) / fps;
    ++number;
    if (source->live()) io.context.progress(std::min(1.0, past_s / seconds), "looking");
    if (!each(picture, time_s, number)) return;
  }
  io.context.check_cancelled();
}

}  // namespace

cli::CommandInfo MarkersCommand::info() {
  return {
      "markers",
      "pages to print: markers for a pen that becomes the drill, and a plate to calibrate a camera by",
      "A PDF of two pages, of true size when printed at 100 %; each is drawn, looked at as a camera would, and "
      "rejected unless all its "
      "markers are read where they are to be. Or .png: one page (--page). docs/how-to/marker.md says how to fold, glue "
      "and calibrate.",
      {{"output", "a .pdf, or a .png of one page"}},
      "osteo markers markers.pdf --paper letter"};
}

int MarkersCommand::run(const Params& p, cli::Invocation& io) {
  const fs::path out = io.arguments[0];
  const std::string kind = out.extension().string();
  if (kind != ".pdf" && kind != ".png")
    throw Error(ExitCode::usage, "'" + out.string() + "' is neither a .pdf nor a .png", "name it markers.pdf");
  if (kind == ".pdf" && io.given.contains("page"))
    throw Error(ExitCode::usage, "--page has no effect with a .pdf", "it holds both pages");
  refuse_to_replace(out, io);
  const std::string pdf = marker_pages_pdf(p.paper, p.pen);  // with its check
  if (kind == ".pdf") {
    write_file(out, pdf);
  } else {
    const GrayPicture page = marker_page(p.paper, p.pen, p.page - 1);
    Picture picture{page.width, page.height, {}};
    for (const std::uint8_t v : page.pixels) picture.rgb.insert(picture.rgb.end(), 3, v);
    save_picture(picture, out);
  }
  io.end_progress();
  if (!io.common.quiet)
    io.err << out.string() << ": pen " << p.pen
           << ", every marker read back in its place. Print at 100 %, hold a ruler to the line of 100 mm"
           << (kind == ".png" ? " (300 dots an inch)" : "") << '\n';
  return 0;
}

cli::CommandInfo CalibrateCameraCommand::info() {
  return {"calibrate-camera",
          "the lens of a webcam, from pictures of the printed plate",
          "Takes pictures of the plate of 'osteo markers' from a camera (for --seconds), a video or a folder, keeps "
          "those that differ, and "
          "finds focal length, centre and distortion. Rejected when fewer than 10 views differ, when the corners lie "
          "more than a pixel "
          "(RMS) from where the lens would show them, or when the plate was hardly ever tilted, since the focal length "
          "stays open then. A "
          "camera that mirrors its pictures is found out and noted.",
          {{"source", "/dev/video0, a video, or a folder of pictures"}},
          "osteo calibrate-camera /dev/video0 -o camera.json"};
}

int CalibrateCameraCommand::run(const Params& p, cli::Invocation& io) {
  refuse_to_replace(p.out, io);
  CameraModel wish;
  wish.width = p.width;
  wish.height = p.height;
  wish.fps = p.fps;
  CameraCalibration calibration;
  look_at_all(io.arguments[0], wish, p.seconds, io, [&](const GrayPicture& picture, double, std::uint64_t) {
    if (calibration.add(picture) == CameraCalibration::Look::taken && !io.common.quiet && !io.common.json) {
      io.end_progress();
      io.err << "view " << calibration.views() << " of at least " << CameraCalibration::kMinViews
             << " taken: move the plate\n";
    }
    return calibration.views() < CameraCalibration::kMaxViews;
  });
  CameraCalibration::Result r = calibration.solve();
  r.camera.fps = p.fps;
  r.camera.latency_ms = p.latency_ms;
  for (const std::string& d : r.doubts) io.context.warn(d);
  write_file(p.out, camera_json(r.camera));
  io.end_progress();
  if (io.common.json) {
    io.out << Json{{"views", r.camera.views},      {"pictures", calibration.pictures()},
                   {"rms_px", r.camera.rms_px},    {"worst_view_px", r.worst_view_px},
                   {"focal_px", r.camera.fx},      {"focal_spread", r.focal_spread},
                   {"mirrored", r.camera.mirrored}}
                  .dump(2)
           << '\n';
  }
  if (!io.common.quiet) {
    io.err << r.camera.width << " x " << r.camera.height << ", " << r.camera.views << " views of "
           << calibration.pictures() << " pictures: corners " << rounded(r.camera.rms_px, 100)
           << " pixels off (RMS; worst view " << rounded(r.worst_view_px, 100) << "), focal length "
           << rounded(r.camera.fx, 1) << " pixels to " << rounded(100 * r.focal_spread, 100) << " %"
           << (r.camera.mirrored ? "; its pictures are mirrored" : "") << ": " << p.out << '\n';
  }
  return 0;
}

cli::CommandInfo CalibratePenCommand::info() {
  return {"calibrate-pen",
          "where the tip of a pen with markers is, by turning the pen on it",
          "Put the tip into a small dent, lean the pen by 30 degrees to all sides and turn it, its markers towards the "
          "camera. Rejected when "
          "it was seen in fewer than 20 pictures, leant by less than 20 degrees, or when the tip wandered by more than "
          "2 mm (RMS).",
          {{"source", "/dev/video0, a video, or a folder of pictures"}},
          "osteo calibrate-pen /dev/video0 --camera camera.json -o pen.json",
          false,
          {},
          {"out"},
          {"camera", "source"}};
}

int CalibratePenCommand::run(const Params& p, cli::Invocation& io) {
  refuse_to_replace(p.out, io);
  const CameraModel camera = load_camera(p.camera);
  Pen pen;
  pen.pen = p.pen;
  pen.scale = p.ruler_mm / 100;
  PenTracker tracker(camera, pen.pen, pen.scale);
  std::vector<RigidTransform> poses;
  std::uint64_t pictures = 0;
  bool dark = false, other = false;
  look_at_all(io.arguments[0], camera, p.seconds, io, [&](const GrayPicture& picture, double, std::uint64_t number) {
    pictures = number;
    const PenSight s = tracker.look(picture);
    dark = dark || s.dark;
    other = other || s.other_pen;
    // Of one marker alone the tilt is not known well enough.
    if (s.state == PenSight::State::seen && s.markers >= 2) poses.push_back(s.camera_from_body);
    return true;
  });
  if (poses.empty())
    throw Error(
        ExitCode::failed,
        "no marker of pen " + std::to_string(p.pen) + " was seen in " + std::to_string(pictures) + " pictures",
        other  ? "another pen was: name it with --pen"
        : dark ? "the pictures are too dark"
               : "is it the print of 'osteo markers', glued as the page says, and is this the camera of that file?");
  const PivotFit fit = fit_pivot(poses);
  pen.tip_mm = fit.tip_mm;
  pen.rms_mm = fit.rms_mm;
  const double lean_deg =
      std::atan2(std::hypot(fit.tip_mm.x, fit.tip_mm.y), -fit.tip_mm.z) * 180 / 3.14159265358979323846;
  if (lean_deg > 8)
    io.context.warn("the tip lies " + rounded(lean_deg, 1) +
                    " degrees beside the axis of the prism: the drill will lean by that; glue it straight");
  write_file(p.out, pen_json(pen));
  io.end_progress();
  if (io.common.json)
    io.out << Json{{"poses", fit.poses},
                   {"left_out", fit.left_out},
                   {"rms_mm", fit.rms_mm},
                   {"worst_mm", fit.worst_mm},
                   {"tilt_deg", fit.tilt_deg},
                   {"tip_mm", std::vector<double>{fit.tip_mm.x, fit.tip_mm.y, fit.tip_mm.z}}}
                  .dump(2)
           << '\n';
  if (!io.common.quiet)
    io.err << "tip " << rounded(length(fit.tip_mm), 10) << " mm from the middle of the prism, by " << fit.poses
           << " of " << pictures << " pictures: it wandered by " << rounded(fit.rms_mm, 100) << " mm (RMS; most "
           << rounded(fit.worst_mm, 100) << "): " << p.out << '\n';
  return 0;
}

cli::CommandInfo TrackPenCommand::info() {
  return {"track-pen",
          "try a camera and a pen: where the tip is, picture by picture",
          "A table as CSV on standard output: time, whether the pen is seen, the tip as seen and as smoothed (mm from "
          "the lens: right, down, "
          "ahead), direction of the handle, error of the corners. At the end how many pictures were lost and why. The "
          "same code that moves "
          "the drill in the window.",
          {{"source", "/dev/video0, a video, or a folder of pictures"}},
          "osteo track-pen /dev/video0 --camera camera.json --pen pen.json > tip.csv"};
}

int TrackPenCommand::run(const Params& p, cli::Invocation& io) {
  const CameraModel camera = load_camera(p.camera);
  const Pen pen = p.pen.empty() ? Pen{} : load_pen(p.pen);
  PenTracker tracker(camera, pen.pen, pen.scale);
  PenFilter filter(pen.tip_mm);
  constexpr const char* kStates[] = {"seen", "nothing", "ambiguous", "doubled", "unlike"};
  std::array<int, 5> count{};
  int pictures = 0, dark = 0;
  bool mirrored = false;
  double sum_px2 = 0;
  Json rows = Json::list();
  if (!io.common.json)
    io.out << "time_s,state,markers,rms_px,tip_x_mm,tip_y_mm,tip_z_mm,smooth_x_mm,smooth_y_mm,smooth_z_mm,axis_x,axis_"
              "y,axis_z\n";
  look_at_all(io.arguments[0], camera, p.seconds, io, [&](const GrayPicture& picture, double time_s, std::uint64_t) {
    const PenSight s = tracker.look(picture);
    ++pictures;
    ++count[static_cast<std::size_t>(s.state)];
    dark += s.dark ? 1 : 0;
    mirrored = mirrored || (s.state == PenSight::State::seen && s.mirrored != camera.mirrored);
    char line[320];
    int n =
        std::snprintf(line, sizeof line, "%.4f,%s,%d", time_s, kStates[static_cast<std::size_t>(s.state)], s.markers);
    if (s.state == PenSight::State::seen) {
      sum_px2 += s.rms_px * s.rms_px;
      filter.add(time_s, s);
      const Vec3 raw = s.camera_from_body(pen.tip_mm), smooth = filter.motion().tip_mm,
                 axis = filter.motion().rotation.column[2];
      std::snprintf(line + n, sizeof line - static_cast<std::size_t>(n),
                    ",%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", s.rms_px, raw.x, raw.y, raw.z, smooth.x,
                    smooth.y, smooth.z, axis.x, axis.y, axis.z);
    } else {
      std::snprintf(line + n, sizeof line - static_cast<std::size_t>(n), ",,,,,,,,,,");
    }
    if (!io.common.json) io.out << line << '\n';
    return true;
  });
  io.end_progress();
  const int seen = count[0];
  if (io.common.json)
    io.out
        << Json{{"pictures", pictures},  {"seen", seen},         {"nothing", count[1]},
                {"ambiguous", count[2]}, {"doubled", count[3]},  {"unlike", count[4]},
                {"dark", dark},          {"mirrored", mirrored}, {"rms_px", seen > 0 ? std::sqrt(sum_px2 / seen) : 0.0}}
               .dump(2)
        << '\n';
  if (mirrored)
    io.context.warn("the pictures are mirrored otherwise than when the camera was calibrated; they were turned back");
  if (p.pen.empty())
    io.context.warn(
        "no --pen: its tip is taken to be 100 mm below the middle of the prism; 'osteo calibrate-pen' finds it");
  if (!io.common.quiet)
    io.err << "seen in " << seen << " of " << pictures << " pictures"
           << (count[2] > 0 ? "; too little of it in " + std::to_string(count[2]) : "")
           << (count[3] > 0 ? "; two with the same print in " + std::to_string(count[3]) : "")
           << (count[4] > 0 ? "; markers that are not this pen in " + std::to_string(count[4]) : "")
           << (dark > 0 ? "; too dark in " + std::to_string(dark) : "") << '\n';
  if (seen == 0)
    throw Error(ExitCode::failed,
                "pen " + std::to_string(pen.pen) + " was not seen in any of " + std::to_string(pictures) + " pictures",
                "more light, nearer, its markers towards the camera; docs/how-to/marker.md");
  return 0;
}

}  // namespace osteo
