// The page to rate with. It asks no network for anything: its policy forbids it, movies of the study's own folder
// excepted.
#include "osteo/assessment/study/study.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::inline assessment::study {
namespace {

constexpr std::string_view kHead = R"html(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; media-src 'self' file:; img-src data:">
<title>Rating</title><style>
html{font:17px/1.4 'Liberation Sans',Arial,sans-serif;color:#1d2430;background:#fff}body{max-width:60rem;margin:1rem auto;padding:0 1rem}
h1{color:#1a406b;font-size:1.6rem}section{border:1px solid #d1d6de;border-radius:.4rem;padding:.6rem 1rem;margin:.8rem 0}section.done{background:#f0f6f1}
h2{font-size:1.15rem;margin:.2rem 0}fieldset{border:0;padding:.2rem 0;margin:0}legend{font-weight:bold;float:left;min-width:12rem;padding:.3rem 0}
label{display:inline-block;padding:.3rem .6rem;border:1px solid #b9c0cc;border-radius:.3rem;margin:.1rem;cursor:pointer}
label:has(:checked){background:#1a406b;color:#fff}label:focus-within{outline:3px solid #e0902c}video{max-width:100%;display:block;margin:.4rem 0}
nav{position:sticky;top:0;background:#fff;padding:.5rem 0;border-bottom:1px solid #d1d6de}button{font:inherit;padding:.4rem .9rem}.quiet{color:#5b6574}
</style></head><body><h1></h1><nav><button id="save">Save as a file</button> <label>Go on with a saved file <input type="file" id="load" accept=".json"></label>
<span id="state" role="status"></span></nav><p class="quiet">Rate each session by itself, in this order. What is chosen stays in this browser until it is saved as a file; nothing is
sent anywhere.</p><main></main><script>
"use strict";
const study = )html";

constexpr std::string_view kTail = R"html(;
const given = {};
const at = (s, i) => s + "\n" + i;
document.querySelector("h1").textContent = study.title + ": rater " + study.rater;
const draft = "osteotome " + study.id + " " + study.rater;
function notify() {
  const all = study.sessions.length * study.items.length, n = Object.keys(given).length;
  document.getElementById("state").textContent = n + " of " + all + " given" + (n === all ? ": all done, save the file" : "");
  for (const s of study.sessions) document.getElementById(s).className = study.items.every(i => at(s, i) in given) ? "done" : "";
}
function keep() { try { localStorage.setItem(draft, JSON.stringify(given)); } catch (e) { /* a browser that keeps nothing of files */ } }
function make(tag, text, parent) { const e = document.createElement(tag); if (text) e.textContent = text; if (parent) parent.append(e); return e; }
study.sessions.forEach((s, n) => {
  const box = make("section", "", document.querySelector("main"));
  box.id = s;
  make("h2", (n + 1) + ". Session " + s, box);
  const movie = make("video", "", box);
  movie.controls = true; movie.preload = "metadata"; movie.src = "../movies/" + s + ".mp4";
  movie.addEventListener("error", () => { const p = make("p", "No movie: movies/" + s + ".mp4 is missing or cannot be played."); p.className = "quiet"; movie.replaceWith(p); });
  study.items.forEach((item, k) => {
    const field = make("fieldset", "", box);
    make("legend", item, field);
    const values = [];
    for (let v = study.lowest; v <= study.highest; ++v) values.push(v);
    values.push(null);
    for (const v of values) {
      const label = make("label", "", field), input = make("input", "", label);
      input.type = "radio"; input.name = s + " " + k; input.value = v === null ? "none" : v;
      label.append(" " + (v === null ? "cannot judge" : v));
      input.addEventListener("change", () => { given[at(s, item)] = v; keep(); notify(); });
    }
  });
});
function show() {
  study.sessions.forEach(s => study.items.forEach((item, k) => {
    if (!(at(s, item) in given)) return;
    const v = given[at(s, item)], want = v === null ? "none" : String(v);
    for (const input of document.getElementsByName(s + " " + k)) input.checked = input.value === want;
  }));
  notify();
}
function result() {
  const ratings = [];
  for (const s of study.sessions) for (const i of study.items) if (at(s, i) in given) ratings.push({session: s, item: i, value: given[at(s, i)]});
  return {osteotome_ratings: 1, study: study.id, rater: study.rater, ratings};
}
document.getElementById("save").addEventListener("click", () => {
  const link = make("a");
  link.href = URL.createObjectURL(new Blob([JSON.stringify(result(), null, 1) + "\n"], {type: "application/json"}));
  link.download = study.rater + ".json";
  link.click();
});
document.getElementById("load").addEventListener("change", async event => {
  try {
    const saved = JSON.parse(await event.target.files[0].text());
    if (saved.rater !== study.rater || saved.study !== study.id) throw new Error("it is of another rater or study");
    for (const r of saved.ratings) given[at(r.session, r.item)] = r.value;
    keep(); show();
  } catch (e) { document.getElementById("state").textContent = "This file cannot be taken: " + e.message; }
});
try { Object.assign(given, JSON.parse(localStorage.getItem(draft) || "{}")); } catch (e) { /* as above */ }
show();
</script></body></html>
)html";

}  // namespace

std::string study_id(const Plan& plan) {
  return hash_text(plan.title + "\n" + std::to_string(plan.seed)).substr(0, 8);
}

std::vector<std::string> rating_order(const Study& study, const std::string& rater) {
  std::vector<std::string> blinds;
  for (const Session& s : study.sessions) blinds.push_back(s.blind);
  statistics::Random random(
      std::stoull(hash_text(std::to_string(study.plan.seed) + "\nform\n" + rater).substr(0, 16), nullptr, 16));
  random.shuffle(blinds);
  return blinds;
}

std::string form_html(const Study& study, const std::string& rater) {
  need_code(rater, "the rater");
  if (study.sessions.empty())
    throw Error(ExitCode::no_input, "the study has no sessions to rate",
                "add them with: osteo study add STUDY metrics.json");
  const Json values{{"title", study.plan.title.empty() ? "Study" : study.plan.title},
                    {"id", study_id(study.plan)},
                    {"rater", rater},
                    {"sessions", Json(rating_order(study, rater))},
                    {"items", Json(study.plan.items)},
                    {"lowest", study.plan.lowest},
                    {"highest", study.plan.highest}};
  // Inside a script "</" would end it.
  std::string data;
  for (const char c : values.dump()) data += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return std::string(kHead) + data + std::string(kTail);
}

}  // namespace osteo::inline assessment::study
