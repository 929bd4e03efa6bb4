#include "osteo/imaging/io/inp_io.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"

namespace osteo::inline imaging {
namespace {

std::string trimmed_upper(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t' || s.back() == '\r')) s.remove_suffix(1);
  std::string upper(s);
  for (char& c : upper) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
  return upper;
}

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(trimmed_upper(line.substr(0, comma)));
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  if (fields.size() > 1 && fields.back().empty()) fields.pop_back();  // a comma at the end
  return fields;
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& name) : name_(name) { split(text); }

  InpFile run() {
    for (InpCard& card : cards_) {
      if (card.name == "NODE") {
        nodes(card);
      } else if (card.name == "ELEMENT") {
        elements(card);
      } else if (card.name == "NSET" || card.name == "ELSET") {
        set(card);
      } else if (card.name == "INCLUDE" || card.name == "INSTANCE" || card.name == "PART") {
        throw fail(card, "*" + card.name + " is not read", "write the model as one flat file");
      } else if (card.name != "HEADING") {
        file_.cards.push_back(std::move(card));
      }
    }
    if (elements_.empty()) throw Error(ExitCode::corrupt, "'" + name_ + "' holds no elements C3D4 or C3D10");
    number_points();
    return std::move(file_);
  }

 private:
  struct Element {
    long number;
    std::vector<long> nodes;
    std::size_t line;
  };

  [[nodiscard]] Error fail(const InpCard& card, const std::string& what, const std::string& advice = {}) const {
    return {ExitCode::corrupt, "'" + name_ + "', line " + std::to_string(card.line) + ": " + what, advice};
  }
  [[nodiscard]] double number(const InpCard& card, const std::string& field) const {
    if (const auto v = inp_number(field)) return *v;
    throw fail(card, "'" + field + "' under *" + card.name + " is no number");
  }
  [[nodiscard]] long whole(const InpCard& card, const std::string& field) const {
    const double v = number(card, field);
    if (v != std::floor(v) || std::abs(v) > 1e15)
      throw fail(card, "'" + field + "' under *" + card.name + " is no whole number");
    return static_cast<long>(v);
  }

  void split(std::string_view text) {
    std::size_t line_number = 0;
    bool continued = false;
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++line_number;
      while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
      if (line.empty() || line.starts_with("**")) continue;
      const bool goes_on = line.ends_with(',');
      if (line.starts_with('*') || (continued && !cards_.empty() && cards_.back().rows.empty() && header_goes_on_)) {
        const auto fields = fields_of(line.starts_with('*') ? line.substr(1) : line);
        std::size_t first = 0;
        if (line.starts_with('*')) {
          cards_.push_back({fields[0], {}, {}, line_number});
          first = 1;
        }
        for (std::size_t i = first; i < fields.size(); ++i) {
          const std::size_t equals = fields[i].find('=');
          cards_.back().options[trimmed_upper(std::string_view(fields[i]).substr(0, equals))] =
              equals == std::string::npos ? "" : trimmed_upper(std::string_view(fields[i]).substr(equals + 1));
        }
        header_goes_on_ = goes_on;
        continued = goes_on;
        continue;
      }
      if (cards_.empty())
        throw Error(ExitCode::corrupt,
                    "'" + name_ + "', line " + std::to_string(line_number) + ": data before any line with '*'");
      auto fields = fields_of(line);
      if (continued && !cards_.back().rows.empty() && cards_.back().name == "ELEMENT") {
        auto& last = cards_.back().rows.back();
        last.insert(last.end(), fields.begin(), fields.end());
      } else {
        cards_.back().rows.push_back(std::move(fields));
      }
      continued = goes_on;
      header_goes_on_ = false;
    }
  }

  void nodes(const InpCard& card) {
    for (const auto& row : card.rows) {
      if (row.size() < 4) throw fail(card, "a line under *NODE holds less than a number and three coordinates");
      const long label = whole(card, row[0]);
      const Vec3 x{number(card, row[1]), number(card, row[2]), number(card, row[3])};
      if (!place_.try_emplace(label, nodes_.size()).second) throw fail(card, "node " + row[0] + " is there twice");
      nodes_.push_back({label, x});
      if (const auto s = card.options.find("NSET"); s != card.options.end())
        file_.node_sets[s->second].push_back(label);
    }
  }

  void elements(const InpCard& card) {
    const auto type = card.options.find("TYPE");
    const std::string kind = type != card.options.end() ? type->second : "";
    const bool ten = kind == "C3D10" || kind == "C3D10H" || kind == "C3D10M" || kind == "C3D10T";
    if (!ten && kind != "C3D4" && kind != "C3D4H")
      throw fail(card, "elements of type " + (kind.empty() ? "?" : kind) + " are not read", "C3D4 and C3D10 are");
    if (!elements_.empty() && ten != file_.quadratic)
      throw fail(card, "linear and quadratic elements are mixed",
                 "rigid things of a contact, as fem --inp-out writes them, are not read back: give fem the mesh and "
                 "the problem that they "
                 "came from");
    file_.quadratic = ten;
    for (const auto& row : card.rows) {
      if (row.size() != (ten ? 11U : 5U))
        throw fail(card, "an element of " + kind + " has " + std::to_string(row.size()) + " numbers, not " +
                             (ten ? "11" : "5"));
      Element e{whole(card, row[0]), {}, card.line};
      for (std::size_t i = 1; i < row.size(); ++i) {
        e.nodes.push_back(whole(card, row[i]));
      }
      elements_.push_back(std::move(e));
      if (const auto s = card.options.find("ELSET"); s != card.options.end())
        file_.element_sets[s->second].push_back(elements_.back().number);
    }
  }

  void set(const InpCard& card) {
    const auto named = card.options.find(card.name);
    if (named == card.options.end()) throw fail(card, "*" + card.name + " has no name");
    auto& sets = card.name == "NSET" ? file_.node_sets : file_.element_sets;
    std::vector<long> members = sets[named->second];
    for (const auto& row : card.rows) {
      if (card.options.contains("GENERATE")) {
        if (row.size() < 2) throw fail(card, "GENERATE needs first, last and perhaps a step");
        const long first = whole(card, row[0]), last = whole(card, row[1]),
                   step = row.size() > 2 ? whole(card, row[2]) : 1;
        if (step < 1 || last < first || (last - first) / step > 100'000'000)
          throw fail(card, "GENERATE cannot go from " + row[0] + " to " + row[1]);
        for (long i = first; i <= last; i += step) members.push_back(i);
        continue;
      }
      for (const auto& field : row) {
        if (const auto other = sets.find(field); other != sets.end()) {
          members.insert(members.end(), other->second.begin(), other->second.end());
        } else if (!field.empty()) {
          members.push_back(whole(card, field));
        }
      }
    }
    sets[named->second] = std::move(members);
  }

  void number_points() {
    std::vector<bool> corner(nodes_.size());
    const auto at = [&](const Element& e, std::size_t i) {
      const auto found = place_.find(e.nodes[i]);
      if (found == place_.end())
        throw Error(ExitCode::corrupt, "'" + name_ + "', element " + std::to_string(e.number) + " under line " +
                                           std::to_string(e.line) + ": there is no node " + std::to_string(e.nodes[i]));
      return found->second;
    };
    for (const Element& e : elements_)
      for (std::size_t i = 0; i < 4; ++i) corner[at(e, i)] = true;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (!corner[n]) continue;
      file_.point_of[nodes_[n].first] = static_cast<std::uint32_t>(file_.mesh.points_mm.size());
      file_.mesh.points_mm.push_back(to_floats(nodes_[n].second));
    }
    constexpr std::size_t kEnds[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    for (const Element& e : elements_) {
      std::array<std::uint32_t, 4> t{};
      for (std::size_t i = 0; i < 4; ++i) t[i] = file_.point_of.at(e.nodes[i]);
      for (std::size_t i = 4; i < e.nodes.size(); ++i) {
        at(e, i);
        file_.middle_of[e.nodes[i]] = {t[kEnds[i - 4][0]], t[kEnds[i - 4][1]]};
      }
      if (!file_.tet_of.try_emplace(e.number, static_cast<std::uint32_t>(file_.mesh.tets.size())).second)
        throw Error(ExitCode::corrupt, "'" + name_ + "': element " + std::to_string(e.number) + " is there twice");
      file_.corners_of[e.number] = t;
      const auto six_volumes = [](Vec3 p, Vec3 q, Vec3 r, Vec3 s) { return dot(cross(q - p, r - p), s - p); };
      const auto kept = [&](std::size_t i) { return from_floats(file_.mesh.points_mm[t[i]]); };
      const auto written = [&](std::size_t i) { return nodes_[at(e, i)].second; };
      const double true_volume = six_volumes(written(0), written(1), written(2), written(3)),
                   volume = six_volumes(kept(0), kept(1), kept(2), kept(3));
      if (true_volume != 0 && !(volume / true_volume > 0.5 && volume / true_volume < 2))
        throw Error(ExitCode::corrupt,
                    "'" + name_ + "', element " + std::to_string(e.number) +
                        ": coordinates are kept in single precision, which turns its volume of " +
                        format_number(true_volume / 6) + " mm3 into " + format_number(volume / 6),
                    "move the body nearer to the origin");
      if (volume < 0) std::swap(t[2], t[3]);
      file_.mesh.tets.push_back(t);
    }
  }

  std::string name_;
  std::vector<InpCard> cards_;
  bool header_goes_on_ = false;
  std::vector<std::pair<long, Vec3>> nodes_;
  std::unordered_map<long, std::size_t> place_;
  std::vector<Element> elements_;
  InpFile file_;
};

}  // namespace

std::optional<double> inp_number(std::string_view field) {
  double v = 0;
  if (field.starts_with('+')) field.remove_prefix(1);
  const auto [at, problem] = std::from_chars(field.data(), field.data() + field.size(), v);
  if (problem != std::errc() || at != field.data() + field.size() || !std::isfinite(v)) return std::nullopt;
  return v;
}

InpFile parse_inp(std::string_view text, const std::string& name) {
  return Parser(text, name).run();
}

}  // namespace osteo::inline imaging
