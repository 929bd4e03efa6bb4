#!/usr/bin/env python3
"""Reference values for libs/core/statistics, by SciPy, statsmodels, pingouin, scikit-learn, irrCAC, mpmath; what none of them has, by its
definition written out in NumPy. Writes testdata/statistics/*.json.

python3 -m venv build/peers-statistics && build/peers-statistics/bin/pip install scipy==1.17.1 statsmodels==0.15.0 pingouin==0.7.0 scikit-learn==1.9.1 irrCAC==0.4.4 mpmath && build/peers-statistics/bin/pip install scipy==1.17.1 (irrCAC asks for an older one, and works with this)
build/peers-statistics/bin/python tests/bench/statistics_reference.py
"""

import itertools, json, math, pathlib, warnings

import mpmath
import numpy as np
import pandas as pd
import pingouin
import scipy
import scipy.optimize
import scipy.signal
import scipy.special
import scipy.stats as st
import sklearn
import statsmodels
import statsmodels.api as sm
from irrCAC.raw import CAC
from sklearn.isotonic import IsotonicRegression
from sklearn.metrics import roc_auc_score, roc_curve
from statsmodels.stats.inter_rater import cohens_kappa
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.power import TTestIndPower
from statsmodels.stats.proportion import proportion_confint

warnings.simplefilter("ignore")
here = pathlib.Path(__file__).resolve().parents[2] / "testdata" / "statistics"
here.mkdir(parents=True, exist_ok=True)
rng = np.random.default_rng(20061)


def plain(v):
    if isinstance(v, dict):
        return {k: plain(x) for k, x in v.items()}
    if isinstance(v, (list, tuple, np.ndarray)):
        return [plain(x) for x in v]
    if isinstance(v, (bool, np.bool_)):
        return bool(v)
    if isinstance(v, (int, np.integer)):
        return int(v)
    if v is None or isinstance(v, str):
        return v
    v = float(v)
    return v if math.isfinite(v) else None


def save(name, content):
    head = {
        "made_by": "tests/bench/statistics_reference.py",
        "with": f"scipy {scipy.__version__}, statsmodels {statsmodels.__version__}, pingouin {pingouin.__version__}, scikit-learn {sklearn.__version__}",
    }
    (here / f"{name}.json").write_text(json.dumps({**head, **plain(content)}, indent=1) + "\n")


def rounded(values, digits=3):
    return np.round(values, digits)


# -- movement: as the authors' code has it, written out again
def sparc(speed, fs, fc=10.0, threshold=0.05, pad=4):
    nfft = int(2 ** (np.ceil(np.log2(len(speed))) + pad))
    f = np.arange(0, fs, fs / nfft)[:nfft]
    m = np.abs(np.fft.fft(speed, nfft))
    m = m / m.max()
    keep = np.flatnonzero(f <= fc)
    f, m = f[keep], m[keep]
    on = np.flatnonzero(m >= threshold)
    f, m = f[on[0] : on[-1] + 1], m[on[0] : on[-1] + 1]
    return -np.sum(np.sqrt((np.diff(f) / (f[-1] - f[0])) ** 2 + np.diff(m) ** 2))


def ldlj(speed, fs):
    dt = 1 / fs
    jerk = np.diff(speed, 2) / dt**2
    return -np.log((len(speed) * dt) ** 3 / np.max(np.abs(speed)) ** 2 * np.sum(jerk**2) * dt)


bumps = rounded(
    np.concatenate([np.sin(np.linspace(0, np.pi, 70)) ** 2, 0.6 * np.sin(np.linspace(0, np.pi, 50)) ** 2])
    + 0.02 * rng.normal(size=120),
    6,
)
b, a = scipy.signal.butter(2, 20, fs=1000)
wobble = rounded(np.cumsum(rng.normal(size=60)), 6)
save(
    "movement",
    {
        "speed": bumps,
        "rate_hz": 100,
        "sparc": sparc(bumps, 100),
        "sparc_20hz_10percent": sparc(bumps, 100, 20, 0.1),
        "ldlj": ldlj(bumps, 100),
        "wobble": wobble,
        "filtered_20_of_1000_hz": scipy.signal.filtfilt(b, a, wobble),
        "filtered_30_of_100_hz": scipy.signal.filtfilt(*scipy.signal.butter(2, 30, fs=100), wobble),
    },
)

# -- basics
values = rounded(rng.normal(size=17))
tied = np.array([3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5.0])
ps = [0.01, 0.04, 0.03, 0.005, 0.5, 0.04]
save(
    "basics",
    {
        "values": values,
        "mean": values.mean(),
        "sd": values.std(ddof=1),
        "shares": [0, 0.1, 0.25, 0.5, 0.9, 1],
        "quantiles": np.quantile(values, [0, 0.1, 0.25, 0.5, 0.9, 1]),
        "tied": tied,
        "ranks": st.rankdata(tied),
        "wilson": [[k, n, *proportion_confint(k, n, method="wilson")] for k, n in ((0, 5), (3, 7), (40, 50), (9, 9))],
        "p": ps,
        "holm": multipletests(ps, method="holm")[1],
    },
)

# -- agreement
a2 = rng.integers(0, 5, 40)
b2 = np.clip(a2 + rng.integers(-1, 2, 40), 0, 4)
table = np.zeros((5, 5))
for i, j in zip(a2, b2):
    table[i, j] += 1
kappas = {}
for name, wt in (("none", None), ("linear", "linear"), ("quadratic", "quadratic")):
    k = cohens_kappa(table, wt=wt)
    kappas[name] = {"value": k.kappa, "standard_error": k.std_kappa, "lo": k.kappa_low, "hi": k.kappa_upp}
raters = np.clip(rng.integers(1, 5, (25, 1)) + rng.integers(-1, 2, (25, 4)), 1, 5).astype(float)
with_holes = raters.copy()
for t, r in ((0, 1), (3, 0), (3, 2), (7, 3), (9, 0), (9, 1), (9, 2), (20, 2)):
    with_holes[t, r] = np.nan


def ac1(matrix):
    # To all digits, as Gwet's R functions have it; irrCAC rounds to five and is what the rounding is held against.
    cats = [1, 2, 3, 4, 5]
    count = np.array([[np.sum(row == c) for c in cats] for row in matrix], float)
    count = count[count.sum(1) > 0]
    n, r, q = len(count), count.sum(1), len(cats)
    twice = r >= 2
    own = np.where(twice, (count * (count - 1)).sum(1) / np.where(twice, r * (r - 1), 1), 0)
    pa = own[twice].mean()
    share = (count / r[:, None]).mean(0)
    pe = np.sum(share * (1 - share)) / (q - 1)
    v = (pa - pe) / (1 - pe)
    linear = (n / twice.sum() * (own - pe * twice)) / (1 - pe) - 2 * (1 - v) * (
        (count / r[:, None] * (1 - share)).sum(1) / (q - 1) - pe
    ) / (1 - pe)
    se = np.sqrt(np.sum((linear - v) ** 2) / n / (n - 1))
    t = st.t.ppf(0.975, n - 1)
    frame = pd.DataFrame(matrix)
    theirs = CAC(frame, weights="identity", categories=cats).gwet()["est"]
    assert abs(theirs["coefficient_value"] - v) < 6e-6 and abs(theirs["se"] - se) < 6e-6, (theirs, v, se)
    return {"percent": 100 * pa, "value": v, "standard_error": se, "lo": max(-1, v - t * se), "hi": min(1, v + t * se)}


def icc(matrix):
    n, k = matrix.shape
    long = pd.DataFrame([(t, r, matrix[t, r]) for t in range(n) for r in range(k)], columns=["t", "r", "v"])
    mine = {}
    rows, cols, all_ = matrix.mean(1), matrix.mean(0), matrix.mean()
    R, C = k * np.sum((rows - all_) ** 2) / (n - 1), n * np.sum((cols - all_) ** 2) / (k - 1)
    W = np.sum((matrix - rows[:, None]) ** 2) / (n * (k - 1))
    E = np.sum((matrix - rows[:, None] - cols + all_) ** 2) / ((n - 1) * (k - 1))
    mine["ms"] = [R, C, E, W]
    F = lambda d1, d2: st.f.ppf(0.975, d1, d2)
    lo, hi = R / W / F(n - 1, n * (k - 1)), R / W * F(n * (k - 1), n - 1)
    mine["1,1"] = [(R - W) / (R + (k - 1) * W), (lo - 1) / (lo + k - 1), (hi - 1) / (hi + k - 1)]
    mine["1,k"] = [(R - W) / R, 1 - 1 / lo, 1 - 1 / hi]
    lo, hi = R / E / F(n - 1, (n - 1) * (k - 1)), R / E * F((n - 1) * (k - 1), n - 1)
    mine["C,1"] = [(R - E) / (R + (k - 1) * E), (lo - 1) / (lo + k - 1), (hi - 1) / (hi + k - 1)]
    mine["C,k"] = [(R - E) / R, 1 - 1 / lo, 1 - 1 / hi]
    rho = (R - E) / (R + (k - 1) * E + k * (C - E) / n)
    A, B = k * rho / (n * (1 - rho)), 1 + k * rho * (n - 1) / (n * (1 - rho))
    v = (A * C + B * E) ** 2 / ((A * C) ** 2 / (k - 1) + (B * E) ** 2 / ((n - 1) * (k - 1)))
    f1, f2 = F(n - 1, v), F(v, n - 1)
    L, U = n * (R - f1 * E) / (f1 * (k * C + (k * n - k - n) * E) + n * R), n * (f2 * R - E) / (
        k * C + (k * n - k - n) * E + n * f2 * R
    )
    mine["A,1"] = [rho, L, U]
    mine["A,k"] = [(R - E) / (R + (C - E) / n), k * L / (1 + (k - 1) * L), k * U / (1 + (k - 1) * U)]
    theirs = pingouin.intraclass_corr(long, "t", "r", "v").set_index("Type")
    for form, name in (
        ("1,1", "ICC(1,1)"),
        ("A,1", "ICC(A,1)"),
        ("C,1", "ICC(C,1)"),
        ("1,k", "ICC(1,k)"),
        ("A,k", "ICC(A,k)"),
        ("C,k", "ICC(C,k)"),
    ):
        row = theirs.loc[name]
        assert abs(row["ICC"] - mine[form][0]) < 1e-12, (form, row["ICC"], mine[form])
        ci = row["CI95" if "CI95" in row else "CI95%"]
        assert np.allclose(ci, mine[form][1:], atol=5.01e-3), (form, ci, mine[form])
    return mine


shrout = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float)
x, y = rounded(rng.normal(10, 2, 12)), None
y = rounded(x + rng.normal(0.3, 0.8, 12))
d = x - y
tq = st.t.ppf(0.975, 11)
save(
    "agreement",
    {
        "a": a2,
        "b": b2,
        "kappa": kappas,
        "ratings": raters,
        "ac1": ac1(raters),
        "with_holes": with_holes,
        "ac1_with_holes": ac1(with_holes),
        "shrout_fleiss": shrout,
        "icc_shrout_fleiss": icc(shrout),
        "icc": icc(raters),
        "x": x,
        "y": y,
        "bland_altman": {
            "bias": [d.mean(), d.mean() - tq * d.std(ddof=1) / 12**0.5, d.mean() + tq * d.std(ddof=1) / 12**0.5],
            "lower": d.mean() - st.norm.ppf(0.975) * d.std(ddof=1),
            "half": tq * d.std(ddof=1) * (3 / 12) ** 0.5,
        },
    },
)


# -- two groups
def groups(a, b):
    a, b = np.asarray(a, float), np.asarray(b, float)
    w = st.ttest_ind(a, b, equal_var=False)
    ci = w.confidence_interval()
    na, nb = len(a), len(b)
    exact = st.PermutationMethod(n_resamples=np.inf)
    u = st.mannwhitneyu(a, b, method=exact if math.comb(na + nb, na) < 300000 else "exact")
    rough = st.mannwhitneyu(a, b, method="asymptotic")
    out = {
        "a": a,
        "b": b,
        "welch": [w.statistic, w.df, w.pvalue, ci.low, ci.high],
        "u": u.statistic,
        "u_p": u.pvalue,
        "u_p_asymptotic": rough.pvalue,
    }
    if math.comb(na + nb, na) < 200000:
        out["permutation_p"] = st.permutation_test(
            (a, b), lambda p, q, axis: np.mean(p, axis) - np.mean(q, axis), vectorized=True, n_resamples=np.inf
        ).pvalue
    df = na + nb - 2
    d = (a.mean() - b.mean()) / np.sqrt(((na - 1) * a.var(ddof=1) + (nb - 1) * b.var(ddof=1)) / df)
    j = math.exp(math.lgamma(df / 2) - math.lgamma((df - 1) / 2)) / math.sqrt(df / 2)
    assert abs(pingouin.compute_effsize(a, b, eftype="cohen") - d) < 1e-12
    scale = math.sqrt(1 / na + 1 / nb)
    mpmath.mp.dps = 30

    def nct_cdf(t, df, nc):  # by integrating over the spread: P(Z + nc <= t sqrt(V / df))
        f = lambda v: mpmath.ncdf(t * mpmath.sqrt(v / df) - nc) * v ** (mpmath.mpf(df) / 2 - 1) * mpmath.exp(-v / 2)
        return mpmath.quad(f, [0, df / 2, df, 2 * df, 5 * df, 20 * df + 200]) / (
            2 ** (mpmath.mpf(df) / 2) * mpmath.gamma(mpmath.mpf(df) / 2)
        )

    t = mpmath.mpf(d) / mpmath.mpf(scale)
    ncp = [
        mpmath.findroot(lambda c: nct_cdf(t, df, c) - p, (float(t) + s, float(t) + s / 2), solver="secant", tol=1e-20)
        for p, s in ((0.975, -2), (0.025, 2))
    ]
    out["g"] = [j * d, j * scale * float(ncp[0]), j * scale * float(ncp[1])]
    dm = np.sign(a[:, None] - b[None, :])
    delta = dm.mean()
    s2 = (
        nb**2 * np.sum((dm.mean(1) - delta) ** 2)
        + na**2 * np.sum((dm.mean(0) - delta) ** 2)
        - np.sum((dm - delta) ** 2)
    ) / (na * nb * (na - 1) * (nb - 1))
    z = st.norm.ppf(0.975)
    half = z * np.sqrt(s2) * np.sqrt((1 - delta**2) ** 2 + z**2 * s2)
    out["delta"] = [
        delta,
        (delta - delta**3 - half) / (1 - delta**2 + z**2 * s2),
        (delta - delta**3 + half) / (1 - delta**2 + z**2 * s2),
    ]
    # ROC: a positive
    v10, v01 = (dm.mean(1) + 1) / 2, (dm.mean(0) + 1) / 2
    se = math.sqrt(v10.var(ddof=1) / na + v01.var(ddof=1) / nb)
    auc = roc_auc_score(np.r_[np.ones(na), np.zeros(nb)], np.r_[a, b])
    fpr, tpr, th = roc_curve(np.r_[np.ones(na), np.zeros(nb)], np.r_[a, b], drop_intermediate=False)
    best = np.argmax(np.round(tpr - fpr, 12))
    out["roc"] = {
        "area": auc,
        "standard_error": se,
        "lo": max(0, auc - z * se),
        "hi": min(1, auc + z * se),
        "true_positive": tpr,
        "false_positive": fpr,
        "best_threshold": th[best],
    }
    return out


save(
    "compare",
    {
        "sets": [
            groups(rounded(rng.normal(4, 0.7, 7)), rounded(rng.normal(2.8, 1.1, 8))),
            groups([1, 2, 2, 3, 3, 3, 5], [2, 2, 3, 4, 4, 5, 5, 5]),
            groups(rounded(rng.normal(0, 1, 22)), rounded(rng.normal(0.4, 2, 18))),
            groups([5.5, 6.1, 4.9], [2.1, 5.0, 3.4]),
        ]
    },
)

# -- correlation
x = rounded(rng.normal(size=15))
y = rounded(0.6 * x + rng.normal(size=15))
p = st.pearsonr(x, y)
s = st.spearmanr(x, np.round(y))
save(
    "correlation",
    {
        "x": x,
        "y": y,
        "pearson": [p.statistic, p.pvalue, p.confidence_interval().low, p.confidence_interval().high],
        "y_tied": np.round(y),
        "spearman": [s.statistic, s.pvalue],
    },
)

# What is left once other lists are held: pingouin's own r and p; its intervals are rounded, so Fisher's formula here, checked against them.


def held(x, y, given, method):
    frame = pd.DataFrame({"x": x, "y": y, **{f"g{k}": g for k, g in enumerate(given)}})
    # Residuals in 40 digits; pingouin's figures agree to what it prints.
    mpmath.mp.dps = 40
    data = frame.rank() if method == "spearman" else frame
    n, k = len(x), len(given)
    G = mpmath.matrix([[1] + [mpmath.mpf(float(data[f"g{j}"][i])) for j in range(k)] for i in range(n)])
    rest = []
    for name in "xy":
        v = mpmath.matrix([mpmath.mpf(float(a)) for a in data[name]])
        rest.append(v - G * mpmath.lu_solve(G.T * G, G.T * v))
    dot = lambda a, b: sum(a[i] * b[i] for i in range(n))
    r = dot(*rest) / mpmath.sqrt(dot(rest[0], rest[0]) * dot(rest[1], rest[1]))
    df = n - 2 - k
    p = 2 * st.t.sf(abs(float(r * mpmath.sqrt(df / (1 - r * r)))), df)
    z, half = mpmath.atanh(r), mpmath.mpf(st.norm.ppf(0.975)) / mpmath.sqrt(n - 3 - k)
    theirs = pingouin.partial_corr(frame, "x", "y", covar=[f"g{j}" for j in range(k)], method=method)
    low, high = float(mpmath.tanh(z - half)), float(mpmath.tanh(z + half))
    interval = theirs["CI95%"].iloc[0] if "CI95%" in theirs else theirs["CI95"].iloc[0]
    p_theirs = theirs["p-val"].iloc[0] if "p-val" in theirs else theirs["p_val"].iloc[0]
    assert (
        abs(theirs["r"].iloc[0] - float(r)) < 1e-9
        and abs(p_theirs - p) < 1e-9
        and np.allclose(interval, [low, high], atol=0.006)
    )
    return [float(r), float(p), low, high]


own = np.random.default_rng(77)  # of its own, so that what comes below stays as it was
first, second = own.normal(size=31), np.round(3 * own.normal(size=31)) + 1000
x, y = own.normal(size=31) + 0.8 * first - 0.1 * second, own.normal(size=31) + 0.5 * first + 0.2 * second
x, y = x + 0.5 * own.normal(size=31), y + 0.3 * x
save(
    "partial_correlation",
    {
        "x": x,
        "y": y,
        "first": first,
        "second": second,
        "pearson_one": held(x, y, [first], "pearson"),
        "pearson_two": held(x, y, [first, second], "pearson"),
        "spearman_two": held(x, y, [first, second], "spearman"),
    },
)


# -- people who repeat
def mixed(y, X, person):
    mpmath.mp.dps = 40
    n, p = X.shape
    Z = (person[:, None] == np.unique(person)[None, :]).astype(float)
    M = lambda a: mpmath.matrix(np.asarray(a).tolist())
    my, mX, mZ = M(y[:, None]), M(X), M(Z)

    def at(lam):
        V = mpmath.eye(n) + lam * (mZ * mZ.T)
        inverse = V**-1
        A = mX.T * inverse * mX
        beta = A**-1 * (mX.T * inverse * my)
        r = my - mX * beta
        q = (r.T * inverse * r)[0]
        return beta, A, q, (n - p) * mpmath.log(q) + mpmath.log(mpmath.det(V)) + mpmath.log(mpmath.det(A))

    fit = sm.MixedLM(y, X, person).fit(reml=True, method=["bfgs", "powell"], gtol=1e-12)
    start = float(fit.cov_re[0, 0] / fit.scale)
    lam = mpmath.findroot(
        lambda l: mpmath.diff(lambda m: at(m)[3], l, h=mpmath.mpf(10) ** -12),
        (start, start * 1.001),
        solver="secant",
        tol=1e-22,
    )
    beta, A, q, dev = at(lam)
    error = q / (n - p)
    cov = A**-1 * error
    ll = -(dev - (n - p) * mpmath.log(q) + (n - p) * (mpmath.log(2 * mpmath.pi * error) + 1)) / 2
    # statsmodels stops a little earlier: the same place to its own precision, and no likelihood above ours.
    assert (
        abs(start - lam) < 1e-3 * (1 + lam)
        and abs(fit.llf - ll) < 1e-8
        and np.allclose(fit.fe_params, [float(v) for v in beta], atol=1e-4)
    )
    return {
        "y": y,
        "design": X.ravel(),
        "columns": p,
        "person": person,
        "beta": list(beta),
        "standard_error": [mpmath.sqrt(cov[i, i]) for i in range(p)],
        "variance_people": lam * error,
        "variance_error": error,
        "log_likelihood": ll,
    }


person = np.repeat(np.arange(9), [1, 3, 2, 4, 2, 2, 3, 1, 2])
group = (person < 4).astype(float)
later = np.concatenate([np.arange(k) for k in np.bincount(person)]).astype(float)
y = rounded(2 + 1.1 * group + 0.3 * later + rng.normal(0, 0.8, 9)[person] + rng.normal(0, 0.5, len(person)))
pairs = rounded(rng.normal(0.5, 1, (9, 2)))
flip = st.permutation_test(
    (pairs[:, 0], pairs[:, 1]),
    lambda a, b, axis: np.mean(a - b, axis),
    permutation_type="samples",
    vectorized=True,
    n_resamples=np.inf,
)
inside = [([1.2, 3.4, 2.2], [1, 0, 0]), ([0.3, 2.0, 1.1, 4.2], [1, 0, 1, 0]), ([5.0, 4.0], [0, 1])]
stat = lambda v, l: np.mean(np.array(v)[np.array(l) == 1]) - np.mean(np.array(v)[np.array(l) == 0])
own = [[stat(v, l) for l in set(itertools.permutations(lab))] for v, lab in inside]
sums = np.array([sum(c) / 3 for c in itertools.product(*own)])
seen = sum(stat(v, l) for v, l in inside) / 3
save(
    "repeated",
    {
        "mixed": mixed(y, np.column_stack([np.ones(len(y)), group, later]), person),
        "pairs": pairs,
        "flip_statistic": flip.statistic,
        "flip_p": flip.pvalue,
        "inside": {
            "values": [v for vs, _ in inside for v in vs],
            "condition": [c for _, cs in inside for c in cs],
            "person": [i for i, (vs, _) in enumerate(inside) for _ in vs],
            "statistic": seen,
            "p": min(1, 2 * min(np.mean(sums <= seen + 1e-12), np.mean(sums >= seen - 1e-12))),
            "ways": len(sums),
        },
    },
)

# -- decisions
a, b = rounded(rng.normal(4, 0.6, 9)), rounded(rng.normal(2.5, 1.0, 11))
la, lb = st.norm(a.mean(), a.std(ddof=1)), st.norm(b.mean(), b.std(ddof=1))
mark = scipy.optimize.brentq(lambda v: la.logpdf(v) - lb.logpdf(v), b.mean(), a.mean(), xtol=1e-15, rtol=1e-14)
power = TTestIndPower()
save(
    "decide",
    {
        "a": a,
        "b": b,
        "mark": mark,
        "competent_fail": la.cdf(mark),
        "other_pass": lb.sf(mark),
        "power": [[d, n, power.power(d, n, 0.05)] for d, n in ((0.5, 64), (0.8, 26), (1.2, 8), (1.5, 4), (0.0, 20))],
        "needed": [[d, power.solve_power(d, power=0.8, alpha=0.05)] for d in (0.3, 0.5, 0.8, 1.2)],
    },
)

# -- isotonic
x = rounded(rng.uniform(0, 10, 40), 1)
y = rounded(np.sqrt(x) + rng.normal(0, 0.6, 40), 2)
w = rounded(rng.uniform(0.2, 3, 40), 2)
ux = np.unique(x)
rise = IsotonicRegression().fit(x, y, sample_weight=w).predict(ux)
fall = IsotonicRegression(increasing=False).fit(x, y).predict(ux)


def pinball(
    share,
):  # the least that any rising curve can lose, as a linear programme: levels, errors above, errors below
    m, n = len(ux), len(x)
    at = np.searchsorted(ux, x)
    c = np.r_[np.zeros(m), share * np.ones(n), (1 - share) * np.ones(n)]
    eq = np.zeros((n, m + 2 * n))
    eq[np.arange(n), at] = 1
    eq[np.arange(n), m + np.arange(n)] = 1
    eq[np.arange(n), m + n + np.arange(n)] = -1
    ub = np.zeros((m - 1, m + 2 * n))
    ub[np.arange(m - 1), np.arange(m - 1)] = 1
    ub[np.arange(m - 1), np.arange(m - 1) + 1] = -1
    return scipy.optimize.linprog(
        c, ub, np.zeros(m - 1), eq, y, bounds=[(None, None)] * m + [(0, None)] * (2 * n), method="highs"
    ).fun


save(
    "isotonic",
    {
        "x": x,
        "y": y,
        "weights": w,
        "places": ux,
        "rising_weighted": rise,
        "falling": fall,
        "least_loss": [[q, pinball(q)] for q in (0.1, 0.25, 0.5, 0.75, 0.9)],
    },
)
print("written to", here)
