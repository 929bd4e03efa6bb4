// The report of a batch as a page, as JSON and as a table. A row at a time: a batch may have ten thousand.
#include <cmath>
#include <fstream>

#include "batch_page_parts.h"
#include "osteo/core/base/csv.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/report/sheet.h"
#include "record.h"

namespace osteo::inline hospital {
namespace {

// A number with the decimals it deserves, or nothing.
std::string number_text(double value, int places) {
  if (value <= 0) return {};
  const double scale = std::pow(10, places);
  return format_number(std::round(value * scale) / scale);
}

std::string state_text(CaseState state) {
  return state == CaseState::resources ? "out of memory or time" : std::string(state_name(state));
}

void cell(std::ostream& out, const std::string& text, const std::string& value) {
  out << "<td class=\"n\" data-v=\"" << value << "\">" << text << "</td>";
}

void html_row(std::ostream& page, const CaseRecord& r, const fs::path& out) {
  std::error_code ec;
  const fs::path folder = case_folder(out, r.code);
  const bool has_report = fs::is_regular_file(folder.string() + ".report.html", ec);
  const bool has_picture = fs::is_regular_file(folder.string() + ".thumbnail.png", ec);
  const bool has_verdict = fs::is_regular_file(folder / "import.svg", ec);
  page << "<tr class=\"" << state_name(r.state) << "\" data-state=\"" << state_name(r.state) << "\"><td>";
  if (has_report)
    page << "<a href=\"cases/" << r.code << ".report.html\">" << r.code << "</a>";
  else
    page << r.code;
  page << "</td><td class=\"pic\">";
  if (has_picture)
    page << "<img loading=\"lazy\" src=\"cases/" << r.code << ".thumbnail.png\" alt=\"bone of " << r.code << "\">";
  page << "</td><td class=\"state\">" << state_text(r.state) << "</td><td>" << html_escaped(r.verdict);
  for (std::size_t i = 0; i < r.findings.size(); ++i)
    page << (i == 0 ? "<small>" : "<br>") << html_escaped(r.findings[i]);
  page << (r.findings.empty() ? "" : "</small>");
  if (has_verdict && r.state == CaseState::refused)
    page << "<small><a href=\"cases/" << r.code << "/import.svg\">its values</a></small>";
  page << "</td>";
  cell(page, number_text(r.volume_mm3 / 1000, 1), number_text(r.volume_mm3, 0));
  cell(page, r.triangles > 0 ? std::to_string(r.triangles) : "", r.triangles > 0 ? std::to_string(r.triangles) : "");
  cell(page, number_text(r.seconds, 1), number_text(r.seconds, 3));
  cell(page, number_text(r.peak_mb, 0), number_text(r.peak_mb, 0));
  cell(page, r.tries > 0 ? std::to_string(r.tries) : "", r.tries > 0 ? std::to_string(r.tries) : "");
  page << "<td class=\"why\">" << html_escaped(r.why);
  if (!r.advice.empty()) page << "<small>" << html_escaped(r.advice) << "</small>";
  page << "</td></tr>\n";
}

void count_box(std::ostream& page, std::size_t count, const char* words) {
  page << "<div><b>" << count << "</b><span>" << words << "</span></div>";
}

void html_page(std::ostream& page, const std::vector<BatchCase>& table, const fs::path& out, const BatchResult& sum,
               double seconds, double peak_mb) {
  page << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
          "content=\"width=device-width\">"
          "<title>Batch</title><style>"
       << kBatchCss << "</style></head><body>\n<header><h1>Batch: " << sum.done << " of " << sum.cases
       << " cases done</h1><p>Not a medical device: for rehearsal, teaching and research, not for treatment "
          "decisions.</p></header>\n"
          "<div class=\"counts\">";
  count_box(page, sum.done, "done");
  count_box(page, sum.refused, "rejected for their input");
  count_box(page, sum.failed, "failed");
  count_box(page, sum.resources, "out of memory or time");
  count_box(page, sum.waiting, "waiting");
  page << "<div><b>" << number_text(seconds / 3600, 2) << "</b><span>hours of work</span></div><div><b>"
       << number_text(peak_mb, 0)
       << "</b><span>MB at the highest</span></div></div>\n"
          "<div class=\"tools\"><button data-show=\"all\" aria-pressed=\"true\">all</button><button data-show=\"done\" "
          "aria-pressed=\"false\">done</button><button data-show=\"refused failed resources\" "
          "aria-pressed=\"false\">not done</button>"
          "<button data-show=\"waiting\" aria-pressed=\"false\">waiting</button>"
          "<input id=\"find\" type=\"search\" placeholder=\"find\" aria-label=\"find in the table\"></div>\n"
          "<div class=\"scroll\"><table id=\"cases\"><thead><tr>";
  const auto head = [&](const char* name, bool number) {
    page << "<th" << (number ? " class=\"n\"" : "") << " aria-sort=\"none\"><button>" << name << "</button></th>";
  };
  head("case", false);
  page << "<th aria-sort=\"none\"></th>";
  head("state", false);
  head("verdict on the scan", false);
  head("bone, cm\xc2\xb3", true);
  head("triangles", true);
  head("seconds", true);
  head("MB", true);
  head("tries", true);
  head("why", false);
  page << "</tr></thead><tbody>\n";
  for (const BatchCase& c : table) {
    CaseRecord waiting;
    waiting.code = c.code;
    html_row(page, known_record(out, c.code).value_or(waiting), out);
  }
  page << "</tbody></table><p id=\"none\" hidden>No such case.</p></div>\n<footer>Seconds and MB (memory at its "
          "highest) are of the last "
          "try. "
          "A case's report, behind its code, shows cuts of the patient.</footer>\n<script>"
       << kBatchJs << "</script></body></html>\n";
}

}  // namespace

BatchResult write_batch_report(const std::vector<BatchCase>& table, const fs::path& out) {
  BatchResult sum;
  double seconds = 0, peak_mb = 0;
  const auto file = [](const fs::path& path, const std::function<void(std::ostream&)>& fill) {
    write_atomically(path, [&](const fs::path& temporary) {
      std::ofstream stream(temporary, std::ios::binary);
      fill(stream);
      stream.flush();
      if (!stream) throw Error(ExitCode::cannot_write, "'" + path.string() + "' cannot be written");
    });
  };
  file(out / "report.csv", [&](std::ostream& csv) {
    csv << csv_line({"case", "state", "exit_code", "verdict", "findings", "bone_mm3", "triangles", "seconds",
                     "peak_memory_mb", "tries", "why", "advice", "program"});
    for (const BatchCase& c : table) {
      const auto r = known_record(out, c.code);
      count(r, sum);
      if (!r) {
        csv << csv_line({c.code, "waiting", "", "", "", "", "", "", "", "", "", "", ""});
        continue;
      }
      seconds += r->seconds;
      peak_mb = std::max(peak_mb, r->peak_mb);
      std::string findings;
      for (const std::string& f : r->findings) findings += (findings.empty() ? "" : " ") + f;
      csv << csv_line({r->code, std::string(state_name(r->state)), std::to_string(r->exit_code), r->verdict, findings,
                       number_text(r->volume_mm3, 3), r->triangles > 0 ? std::to_string(r->triangles) : "",
                       number_text(r->seconds, 3), number_text(r->peak_mb, 0), std::to_string(r->tries), r->why,
                       r->advice, r->program});
    }
  });
  file(out / "report.json", [&](std::ostream& json) {
    json << "{\n  \"osteotome_batch_report\": 1,\n  \"cases\": " << sum.cases << ",\n  \"done\": " << sum.done
         << ",\n  \"refused\": " << sum.refused << ",\n  \"failed\": " << sum.failed
         << ",\n  \"resources\": " << sum.resources << ",\n  \"waiting\": " << sum.waiting
         << ",\n  \"seconds\": " << format_number(seconds) << ",\n  \"peak_memory_mb\": " << format_number(peak_mb)
         << ",\n  \"rows\": [";
    const char* comma = "\n    ";
    for (const BatchCase& c : table) {
      const auto r = known_record(out, c.code);
      Json row = r ? r->to_json() : Json{{"case", c.code}, {"state", "waiting"}};
      row.erase("osteotome_batch_case");
      row.erase("key");
      json << comma << row.dump();
      comma = ",\n    ";
    }
    json << "\n  ]\n}\n";
  });
  file(out / "report.html", [&](std::ostream& page) { html_page(page, table, out, sum, seconds, peak_mb); });
  return sum;
}

}  // namespace osteo::inline hospital
