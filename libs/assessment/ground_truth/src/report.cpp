// What comes out: tables, plots, the leaderboard, files.
#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "tables.h"

namespace osteo::inline assessment::truth {
namespace {

std::string markdown_of(const ResultTable& t) {
  std::string text = "\n### " + t.title + "\n\n";
  if (!t.note.empty()) text += t.note + "\n\n";
  const auto line = [](const std::vector<std::string>& cells) {
    std::string row = "|";
    for (const std::string& c : cells) row += " " + c + " |";
    return row + "\n";
  };
  text += line(t.head) + "|" + [&] {
    std::string rule;
    for (std::size_t i = 0; i < t.head.size(); ++i) rule += "---|";
    return rule;
  }() + "\n";
  for (const auto& c : t.cells) text += line(c);
  return text;
}

sheet::Table sheet_table(const ResultTable& t) {
  sheet::Table out;
  out.head = t.head;
  for (const auto& row : t.cells) {
    std::vector<sheet::Cell> cells;
    for (const std::string& c : row) cells.push_back({c, Tone::plain});
    out.rows.push_back(std::move(cells));
  }
  // Columns by the longest of their words.
  for (std::size_t c = 0; c < t.head.size(); ++c) {
    std::size_t longest = 5;
    for (std::size_t from = 0; from < t.head[c].size();) {
      const std::size_t to = std::min(t.head[c].find(' ', from), t.head[c].size());
      longest = std::max(longest, to - from);
      from = to + 1;
    }
    for (const auto& row : t.cells) longest = std::max(longest, std::min<std::size_t>(row[c].size(), 24));
    out.widths.push_back(static_cast<double>(longest));
  }
  return out;
}

// Errors of those ranked, as points over a logarithmic axis.
sheet::Plot rank_plot(const std::vector<Rank>& ranks) {
  sheet::Plot plot;
  plot.id = "ranks";
  plot.title = "Mean force error; hollow: with friction";
  double lo = 1e9, hi = -1e9;
  sheet::Plot::Points plain, rough;
  plain.tone = Tone::good;
  rough.tone = Tone::caution;
  rough.hollow = true;
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    const auto at = [&](double v) {
      const double y = std::log10(std::max(1e-6, v));
      lo = std::min(lo, y);
      hi = std::max(hi, y);
      return sheet::Plot::At{static_cast<double>(i) + 1, y};
    };
    plain.at.push_back(at(ranks[i].mean_n));
    rough.at.push_back(at(ranks[i].friction_mean_n));
    plot.x.named.emplace_back(static_cast<double>(i) + 1, std::to_string(i + 1));
  }
  plot.points = {plain, rough};
  plot.x.from = 0.5;
  plot.x.to = static_cast<double>(ranks.size()) + 0.5;
  plot.x.tick = 1;
  plot.x.name = "place in the table above";
  plot.y = {std::floor(lo), std::ceil(hi), 1, "N", {}};
  for (double d = plot.y.from; d <= plot.y.to; ++d) plot.y.named.emplace_back(d, digits(std::pow(10, d), 1));
  return plot;
}

Json json_of(const ResultTable& t) {
  Json rows = Json::list();
  for (const auto& c : t.cells) rows.push_back(Json(c));
  return Json{{"id", t.id}, {"title", t.title}, {"head", Json(t.head)}, {"rows", rows}};
}

}  // namespace

std::string markdown_of(const GroundTruthResult& r) {
  std::string text = "# Ground truth of haptic rendering\n";
  if (!r.bars.empty()) {
    text += "\n| bar | limit | measured | |\n|---|---|---|---|\n";
    for (const Bar& b : r.bars)
      text += "| " + b.what + " | " + b.limit + " | " + b.measured + " | " + (b.held ? "held" : "missed") + " |\n";
  }
  for (const ResultTable& t : r.tables) text += markdown_of(t);
  return text;
}

std::string results_json(const GroundTruthResult& r, const GroundTruthOptions& o) {
  Json tables = Json::list(), bars = Json::list();
  for (const ResultTable& t : r.tables) tables.push_back(json_of(t));
  for (const Bar& b : r.bars)
    bars.push_back({{"what", b.what}, {"limit", b.limit}, {"measured", b.measured}, {"held", b.held}});
  return Json{{"osteotome_ground_truth_results", 1},
              {"seed", o.seed},
              {"share", o.share},
              {"bars", bars},
              {"tables", tables}}
             .dump(1) +
         "\n";
}

Sheet leaderboard_sheet(const GroundTruthResult& r, const GroundTruthOptions& o) {
  Sheet s;
  s.title = "Ground truth of haptic rendering";
  s.code = "seed " + std::to_string(o.seed);
  s.footer = "osteo bench ground-truth: analytic solids, no person and no device";
  s.marks["ground-truth-seed"] = std::to_string(o.seed);
  s.pages = 12;
  const auto add = [&](auto block) { s.blocks.push_back({std::move(block)}); };
  if (!r.bars.empty()) {
    const bool all = std::all_of(r.bars.begin(), r.bars.end(), [](const Bar& b) { return b.held; });
    const auto missed = std::count_if(r.bars.begin(), r.bars.end(), [](const Bar& b) { return !b.held; });
    add(sheet::Band{all ? "All bars held" : std::to_string(missed) + " missed",
                    "Errors of renderers against solids of which surface, normal and force are known.",
                    all ? Tone::good : Tone::caution});
    sheet::Table t;
    t.head = {"bar", "limit", "measured", ""};
    t.widths = {60, 14, 14, 10};
    for (const Bar& b : r.bars)
      t.rows.push_back({{b.what, Tone::plain},
                        {b.limit, Tone::plain},
                        {b.measured, Tone::plain},
                        {b.held ? "held" : "missed", b.held ? Tone::good : Tone::bad}});
    add(std::move(t));
  }
  if (!r.ranks.empty()) {
    add(sheet::Heading{"Leaderboard"});
    add(
        sheet::Paragraph{"Mean over all solids of the mean force error, lifts included. Time and memory are the "
                         "largest of any solid, on "
                         "the machine that ran this.",
                         Tone::quiet});
    sheet::Table t;
    t.head = {"", "renderer", "mean N", "with friction N", "largest N", "missed ms", "pushed in", "ns p50", "MB"};
    t.widths = {4, 22, 10, 12, 10, 10, 10, 10, 8};
    for (std::size_t i = 0; i < r.ranks.size(); ++i) {
      const Rank& k = r.ranks[i];
      t.rows.push_back({{std::to_string(i + 1), Tone::plain},
                        {k.renderer, Tone::plain},
                        {fixed(k.mean_n, 5), Tone::plain},
                        {fixed(k.friction_mean_n, 5), Tone::plain},
                        {fixed(k.max_n, 3), Tone::plain},
                        {fixed(k.missed_ms, 0), k.missed_ms > 0 ? Tone::bad : Tone::plain},
                        {std::to_string(k.popped), k.popped > 0 ? Tone::bad : Tone::plain},
                        {fixed(k.ns_p50, 0), Tone::plain},
                        {fixed(k.memory_mb, 1), Tone::plain}});
    }
    add(std::move(t));
    add(rank_plot(r.ranks));
  }
  for (const ResultTable& t : r.tables) {
    add(sheet::Heading{t.title});
    if (!t.note.empty()) add(sheet::Paragraph{t.note, Tone::quiet});
    for (const sheet::Plot& p : t.plots) add(p);
    add(sheet_table(t));
  }
  return s;
}

void require_result_folder(const std::filesystem::path& folder, bool replace) {
  if (!output_exists(folder) || (fs::is_directory(folder) && fs::is_empty(folder))) return;
  if (!fs::exists(folder / "results.json") || !fs::exists(folder / "leaderboard.html"))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds something that is no result of this",
                "give another folder");
  if (!replace)
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' holds results already", "--force replaces them");
}

void write_ground_truth(const GroundTruthResult& r, const GroundTruthOptions& o, const std::filesystem::path& folder,
                        bool replace) {
  const auto may_replace = [&](const fs::path& old) { require_result_folder(old, replace); };
  write_folder_atomically(folder, may_replace, [&](const fs::path& out) {
    write_file(out / "results.json", results_json(r, o));
    write_file(out / "tables.md", markdown_of(r));
    GroundTruthResult costs;
    costs.tables = r.costs;
    write_file(out / "costs.md", markdown_of(costs));
    const Sheet s = leaderboard_sheet(r, o);
    write_file(out / "leaderboard.html", sheet_html(s));
    write_file(out / "leaderboard.pdf", sheet_pdf(s));
    fs::create_directory(out / "trajectories");
    for (const std::string& name : solid_names()) {
      const auto solid = make_solid(name);
      TruthParams p;
      p.path.seed = o.seed;
      p.friction = 0.3;
      p.lifts = true;
      p.seconds = std::max(1.0, 20 * o.share);
      const Trajectory t = true_trajectory(*solid, p);
      write_file(out / "trajectories" / (name + ".probe.traj"), traj_text(t, TrajectoryRole::probe));
      write_file(out / "trajectories" / (name + ".out.traj"), traj_text(t, TrajectoryRole::out));
      write_file(out / "trajectories" / (name + ".in.traj"), traj_text(t, TrajectoryRole::in));
      write_file(out / "trajectories" / (name + ".csv"), trajectory_csv(t));
    }
  });
}

}  // namespace osteo::inline assessment::truth
