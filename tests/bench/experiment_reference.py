#!/usr/bin/env python3
"""Reference values for repeated measures and paired comparisons (libs/core/statistics/within.h), by SciPy, statsmodels and pingouin; what none of
them has, by its definition written out in NumPy. Writes testdata/statistics/within.json.

python3 -m venv build/peers-statistics && build/peers-statistics/bin/pip install scipy statsmodels pingouin
build/peers-statistics/bin/python tests/bench/experiment_reference.py
"""

import json, math, pathlib, warnings

import numpy as np
import pandas as pd
import pingouin
import scipy
import scipy.stats as st
import statsmodels
from scipy.optimize import brentq
from statsmodels.stats.anova import AnovaRM
from statsmodels.stats.power import TTestPower

warnings.simplefilter("ignore")
out = pathlib.Path(__file__).resolve().parents[2] / "testdata" / "statistics" / "within.json"
rng = np.random.default_rng(4)
cases = []
for people, conditions, spread in [(12, 3, 0.3), (12, 3, 0.05), (6, 4, 0.4), (20, 2, 0.2)]:
    y = np.round(
        0.5
        + 0.2 * rng.normal(size=(people, 1))
        + spread * rng.normal(size=(people, conditions)) * np.linspace(0.5, 1.5, conditions)
        - 0.08 * np.arange(conditions),
        4,
    )
    frame = pd.DataFrame(
        {"p": np.repeat(np.arange(people), conditions), "c": np.tile(np.arange(conditions), people), "y": y.ravel()}
    )
    model = AnovaRM(frame, "y", "p", within=["c"]).fit().anova_table.iloc[0]
    wide = frame.pivot(index="p", columns="c", values="y")
    gg, hf = (float(pingouin.epsilon(wide, correction=c)) for c in ("gg", "hf")) if conditions > 2 else (1.0, 1.0)
    f, d1, d2 = float(model["F Value"]), float(model["Num DF"]), float(model["Den DF"])
    table = pingouin.rm_anova(frame, dv="y", within="c", subject="p", detailed=True, effsize="ng2")
    all_, rows, cols = y.mean(), y.mean(1), y.mean(0)
    ss_c, ss_e = people * ((cols - all_) ** 2).sum(), ((y - rows[:, None] - cols[None] + all_) ** 2).sum()
    pooled = st.f_oneway(*y.T)
    case = {
        "people": people,
        "conditions": conditions,
        "values": y.ravel().tolist(),
        "f": f,
        "df_conditions": d1,
        "df_error": d2,
        "p": float(model["Pr > F"]),
        "epsilon_gg": gg,
        "epsilon_hf": min(1.0, hf),
        "p_gg": float(st.f.sf(f, gg * d1, gg * d2)),
        "p_hf": float(st.f.sf(f, min(1, hf) * d1, min(1, hf) * d2)),
        "partial_eta2": float(ss_c / (ss_c + ss_e)),
        "generalised_eta2": float(table["ng2"].iloc[0]),
        "pooled_f": float(pooled.statistic),
        "pooled_p": float(pooled.pvalue),
    }
    a, b = y[:, 0], y[:, 1]
    t = st.ttest_rel(a, b)
    ci = t.confidence_interval(0.95)
    d, n = a - b, people
    ncp = [
        brentq(
            lambda m: st.nct.cdf(float(t.statistic), n - 1, m) - q,
            float(t.statistic) - 12,
            float(t.statistic) + 12,
            xtol=1e-13,
            rtol=1e-14,
        )
        for q in (0.975, 0.025)
    ]
    both = a.var(ddof=1) + b.var(ddof=1)
    hedges = math.exp(math.lgamma((n - 1) / 2) - math.lgamma((n - 2) / 2)) / math.sqrt((n - 1) / 2)
    scale = d.std(ddof=1) * math.sqrt(2 / (n * both))
    case["paired"] = {
        "difference": float(d.mean()),
        "t": float(t.statistic),
        "p": float(t.pvalue),
        "interval": [float(ci.low), float(ci.high)],
        "dz": float(d.mean() / d.std(ddof=1)),
        "dz_interval": [m / math.sqrt(n) for m in ncp],
        "g_av": float(hedges * d.mean() / math.sqrt(both / 2)),
        "g_av_interval": [hedges * m * scale for m in ncp],
    }
    cases.append(case)
power = [
    {"people": n, "dz": dz, "power": float(TTestPower().power(dz, n, 0.05, alternative="two-sided"))}
    for n in (8, 12, 20, 90)
    for dz in (0.2, 0.5, 0.89, 1.2)
]
out.write_text(
    json.dumps(
        {
            "made_by": "tests/bench/experiment_reference.py",
            "with": f"scipy {scipy.__version__}, statsmodels {statsmodels.__version__}, pingouin {pingouin.__version__}",
            "anova": cases,
            "power": power,
        },
        indent=1,
    )
    + "\n"
)
print("written to", out)
