#!/usr/bin/env python3
"""The tables of docs/validation/trainee.md from what trainee_bench wrote: trainee_table.py FOLDER. Needs numpy."""

import itertools, json, sys
import numpy as np

folder = sys.argv[1]
SKILLS = ["region", "undercut", "force_control", "tremor_mm", "speed_mm_s", "knowledge", "instruments", "camera"]


def metrics_of(run):
    m = {v["name"] + (f"[{v['of']}]" if v.get("of") else ""): v["value"] for v in run["score"]["metrics"]}
    total = lambda name: sum(v for k, v in m.items() if k.startswith(name + "[") and v is not None)
    # One value for all structures, where a session has them.
    m["injured_s, all"] = total("injured_s")
    m["excess_force_ns, all"] = total("excess_force_ns")
    bands = [v for k, v in m.items() if k.startswith("force_above_band_share[") and v is not None]
    m["force_above_band_share, mean"] = float(np.mean(bands)) if bands else None
    if m.get("stroke_mm") and m.get("stroke_s"):
        m["stroke_mm / stroke_s"] = m["stroke_mm"] / m["stroke_s"]
    return m


def column(runs, name):
    return np.array([np.nan if r.get(name) is None else float(r[name]) for r in runs])


def ranks(x):
    # The mean rank for equal values.
    values, where, counts = np.unique(x, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[where]


COMBINATIONS = {}


def exact_p(a, b):
    # Mann-Whitney, two-sided: all ways to deal the ranks.
    key = (len(a), len(b))
    if key not in COMBINATIONS:
        COMBINATIONS[key] = np.array(list(itertools.combinations(range(sum(key)), key[0])))
    r = ranks(np.concatenate([a, b]))
    middle = len(a) * (sum(key) + 1) / 2
    return np.mean(np.abs(r[COMBINATIONS[key]].sum(axis=1) - middle) >= abs(r[: len(a)].sum() - middle) - 1e-9)


def rho(x, y):
    ok = np.isfinite(x) & np.isfinite(y)
    if ok.sum() < 10 or np.ptp(y[ok]) == 0:
        return np.nan, int(ok.sum())
    return np.corrcoef(ranks(x[ok]), ranks(y[ok]))[0, 1], int(ok.sum())


def rests(y, others):
    # What a straight line through the others' ranks leaves of y's ranks.
    a = np.column_stack([np.ones(len(y))] + [ranks(o) for o in others])
    r = ranks(y)
    return r - a @ np.linalg.lstsq(a, r, rcond=None)[0]


def partial(x, y, others):
    # Rank correlation with the other skills held, and by Fisher's z its interval of 95 %.
    ok = np.isfinite(y)
    if ok.sum() < len(others) + 10 or np.ptp(y[ok]) == 0:
        return np.nan, np.nan, np.nan
    held = [o[ok] for o in others]
    r = np.corrcoef(rests(x[ok], held), rests(y[ok], held))[0, 1]
    off = 1.96 / np.sqrt(ok.sum() - len(others) - 3)
    return r, np.tanh(np.arctanh(r) - off), np.tanh(np.arctanh(r) + off)


def explained(y, all_skills):
    # Share of a metric's ranks' variance that goes with the skills' ranks.
    ok = np.isfinite(y)
    left = rests(y[ok], [s[ok] for s in all_skills])
    return 1 - np.var(left) / np.var(ranks(y[ok]))


data = json.load(open(folder + "/runs.json"))
skills = {s: np.array([d["skill"][s] for d in data]) for s in SKILLS}
runs = [metrics_of(d) for d in data]
print(f"## {len(runs)} runs, every skill by itself\n")
print("| metric | runs | " + " | ".join(SKILLS) + " |\n|---|" + "---|" * (len(SKILLS) + 1))
shown = [
    "seen_share",
    "hidden_mm3",
    "force_p95_n",
    "force_median_n",
    "force_peak_n",
    "force_above_band_share, mean",
    "excess_force_ns, all",
    "region_log_ratio",
    "region_per_voxel",
    "region_thesis",
    "target_share[mastoid cells]",
    "outside_target_mm3",
    "path_mm",
    "duration_s",
    "drilling_s",
    "removed_mm3",
    "rate_mm3_per_s",
    "stroke_mm",
    "stroke_s",
    "stroke_mm / stroke_s",
    "stroke_variance",
    "sparc",
    "ldlj",
    "injured_s, all",
    "forbidden_mm3[wall of the ear canal]",
    "burr_choice_share",
    "camera_moves",
    "camera_s",
    "items_passed",
]
extra = sorted(
    {k for r in runs for k in r if k.startswith(("sparc", "ldlj", "log_dimensionless", "tremor"))} - set(shown)
)
for name in shown + extra:
    values = column(runs, name)
    if not np.isfinite(values).any():
        continue
    row = [rho(skills[s], values) for s in SKILLS]
    print(
        f"| `{name}` | {row[0][1]} | "
        + " | ".join(("**%.2f**" if abs(r) >= 0.85 else "%.2f") % r if np.isfinite(r) else "-" for r, _ in row)
        + " |"
    )

print("\n## With the other skills held: partial rank correlation (interval of 95 %)\n")
print("| metric | " + " | ".join(SKILLS) + " | explained by all |\n|---|" + "---|" * (len(SKILLS) + 1))
for name in [
    "seen_share",
    "hidden_mm3",
    "force_p95_n",
    "force_median_n",
    "force_above_band_share, mean",
    "region_per_voxel",
    "items_passed",
]:
    values = column(runs, name)
    if not np.isfinite(values).any():
        continue
    cells = []
    for s in SKILLS:
        r, lo, hi = partial(skills[s], values, [skills[o] for o in SKILLS if o != s])
        cells.append(
            "-"
            if not np.isfinite(r)
            else ("**%.2f** (%.2f, %.2f)" if lo * hi > 0 else "%.2f (%.2f, %.2f)") % (r, lo, hi)
        )
    print(f"| `{name}` | " + " | ".join(cells) + f" | {explained(values, [skills[s] for s in SKILLS]):.2f} |")

alone = json.load(open(folder + "/alone.json"))
print("\n## Bars: all skills vary at once, and this one alone\n")
for skill, name, bar in [
    ("undercut", "seen_share", 0.9),
    ("force_control", "force_p95_n", 0.9),
    ("region", "region_per_voxel", 0.85),
    ("region", "region_log_ratio", 0.85),
    ("force_control", "force_peak_n", 0.9),
    ("force_control", "force_above_band_share, mean", 0.9),
    ("force_control", "excess_force_ns, all", 0.9),
]:
    r, n = rho(skills[skill], column(runs, name))
    mine = [d for d in alone if d["name"].rstrip("0123456789") == skill]
    a, m = rho(np.array([d["skill"][skill] for d in mine]), column([metrics_of(d) for d in mine], name))
    print(f"| {skill} | {name} | {bar} | {r:.3f} in {n} | {a:.3f} in {m}: {'held' if abs(a) >= bar else 'NOT held'} |")

# Items against what the trainee itself knows, over all sessions there are.
people = json.load(open(folder + "/people.json"))
same = judged = 0
by_item = {}
draws = 0
for d in data + people + alone:
    truth = {t["item"]: t["pass"] for t in d["trainee"]["truth"]}
    for item in d["score"]["items"]:
        if item["name"] in truth and item["pass"] is not None:
            ok = item["pass"] == truth[item["name"]]
            n, m, f = by_item.get(item["name"], (0, 0, 0))
            by_item[item["name"]] = (n + 1, m + ok, f + (not truth[item["name"]]))
            judged += 1
            draws += (not ok) and abs(item["margin"]) < 0.2
            same += ok
print(
    f"\n## Items against the trainee's own truth: {same} of {judged} agree ({same / max(1, judged):.3f}); {draws} of the others a draw\n"
)
for name, (n, m, f) in by_item.items():
    print(f"| {name} | {n} | {f} failed by truth | {m / n:.3f} |")

# Experts and novices: 8 and 7 drawn of the pool, the mean of both sessions of each.
names = sorted({d["name"].rsplit("-", 1)[0] for d in people})
per = {n: [metrics_of(d) for d in people if d["name"].rsplit("-", 1)[0] == n] for n in names}
experts, novices = [n for n in names if n[0] == "E"], [n for n in names if n[0] == "N"]
rng = np.random.default_rng(1)
print(
    f"\n## Separation: 200 draws of 8 of {len(experts)} experts and 7 of {len(novices)} novices, Mann-Whitney exact, two-sided, p < 0.05\n"
)
draws = [(rng.choice(len(experts), 8, False), rng.choice(len(novices), 7, False)) for _ in range(200)]
for name in ["seen_share", "region_per_voxel", "region_thesis", "force_p95_n", "items_passed", "path_mm", "duration_s"]:
    value = lambda who: np.array(
        [np.nanmean([np.nan if m.get(name) is None else m[name] for m in per[n]]) for n in who]
    )
    e, v = value(experts), value(novices)
    found = np.mean([exact_p(e[a], v[b]) < 0.05 for a, b in draws])
    print(f"| `{name}` | {np.mean(e):.3g} | {np.mean(v):.3g} | {100 * found:.1f} % |")

# A simulated rating: what the skills come to, with an error, so that an R stands beside the thesis' own.
WORST = dict(region=0, undercut=1, force_control=0, tremor_mm=0.5, speed_mm_s=12, knowledge=0, instruments=0, camera=0)
BEST = dict(region=1, undercut=0, force_control=1, tremor_mm=0.02, speed_mm_s=40, knowledge=1, instruments=1, camera=1)
overall = lambda s: np.mean([np.clip((s[k] - WORST[k]) / (BEST[k] - WORST[k]), 0, 1) for k in SKILLS])
rating = np.array([overall(d["skill"]) for d in people]) * 5.2 + 0.2 + 0.5 * rng.standard_normal(len(people))
rating = np.clip(np.round(rating), 1, 5)
print("\n## R with a simulated rating (thesis: 0.68 visibility, 0.76 regions, of people)\n")
for name in ["seen_share", "region_log_ratio", "region_per_voxel", "region_thesis", "force_p95_n"]:
    values = column([metrics_of(d) for d in people], name)
    ok = np.isfinite(values)
    print(f"| `{name}` | {np.corrcoef(values[ok], rating[ok])[0, 1]:.2f} |")
