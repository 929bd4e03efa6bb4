"""osteo doctor --server: each thing that keeps a service from working is made, and must be told; and where all is well it must say so.
usage: check_doctor.py BIN WORK SOURCE"""

import json, os, pathlib, shutil, socket, subprocess, sys

bin_dir, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
osteo = bin_dir / "osteo"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
os.umask(0o022)


def doctor(*flags, rc=None, path=None, before=(), pictures=("--no-report",)):
    """What is found, by what it is about; several findings of one kind are joined."""
    env = {**os.environ, **({"PATH": path} if path else {})}
    command = [
        *before,
        osteo,
        "doctor",
        "--server",
        "--json",
        "--memory-mb",
        "10",
        "--keep-free-gb",
        "0",
        "--port",
        str(port),
        *pictures,
        *flags,
    ]
    r = subprocess.run([str(c) for c in command], capture_output=True, text=True, env=env)
    assert rc is None or r.returncode == rc, (flags, r.returncode, r.stdout, r.stderr)
    j = json.loads(r.stdout)
    assert j["good"] == (r.returncode == 0) == all(c["state"] != "bad" for c in j["checks"]), j
    assert all(c["advice"] for c in j["checks"] if c["state"] in ("bad", "care")), j
    found = {}
    for c in j["checks"]:
        found.setdefault(c["what"], []).append((c["state"], c["says"] + " -> " + c["advice"]))
    return found


def told(found, what, state, words, n=0):
    assert what in found and found[what][n][0] == state and words in found[what][n][1], (
        what,
        state,
        words,
        found.get(what),
    )


with socket.socket() as s:
    s.bind(("127.0.0.1", 0))
    port = s.getsockname()[1]
inbox, cases = work / "inbox", work / "cases"
inbox.mkdir(mode=0o700)
pathlib.Path("login").write_text("doctor:tell-nobody\n")
os.chmod("login", 0o600)
pathlib.Path("receive.prom").write_text("as it was\n")
rules = source / "pipelines/rules.json"
given = (
    "--inbox",
    inbox,
    "--cases",
    cases,
    "--rules",
    rules,
    "--login",
    "login",
    "--metrics",
    "receive.prom",
    "--allow",
    "ORTHANC,CT_1",
)

good = doctor(*given, rc=0, pictures=())
for what in ("machine", "inbox", "cases", "temporary", "title", "port", "login", "counters", "rules", "pictures"):
    assert good[what][0][0] in ("good", "care"), good[what]
told(good, "login", "good", "only")
told(good, "rules", "good", "can be carried out")
told(good, "cases", good["cases"][0][0], "free")
assert "tell-nobody" not in str(good)
assert pathlib.Path("receive.prom").read_text() == "as it was\n" and not list(inbox.iterdir()) and not cases.exists()
assert not list(work.glob(".osteo-doctor*"))
text = subprocess.run(
    [osteo, "doctor", "--server", "--port", str(port), "--memory-mb", "10", "--inbox", inbox, "--no-report"],
    capture_output=True,
    text=True,
).stdout
assert len(text.splitlines()) in (10, 11) and all(
    line.split()[0] in ("good", "none", "care", "bad") for line in text.splitlines()
), text
print("ok  a machine that can be a server, and nothing on it is changed")

# Folders: open to all, not to be written, full, one in the other, a file in their place.
inbox.chmod(0o755)
told(doctor("--inbox", inbox, rc=0), "inbox", "care", "names patients")
inbox.chmod(0o700)
closed = (
    pathlib.Path("/proc") if os.geteuid() == 0 else work / "closed"
)  # root may write wherever a file system lets it
if os.geteuid() != 0:
    closed.mkdir(mode=0o555)
told(doctor("--inbox", closed / "inbox", rc=7), "inbox", "bad", "cannot write")
told(doctor("--cases", inbox / "cases", "--inbox", inbox, rc=7), "folders", "bad", "watched")
told(doctor("--inbox", "login", "--cases", "login/deeper", rc=7), "inbox", "bad", "no folder")
told(doctor("--inbox", inbox, "--keep-free-gb", "1000000", rc=7), "inbox", "bad", "to stay free")
mounted = [
    "unshare",
    "-rm",
    "sh",
    "-c",
    "mkdir -p full && mount -t tmpfs -o size=64k none full && { head -c 1M /dev/zero > full/x 2>/dev/null; exec \"$@\"; }",
    "sh",
]
if subprocess.run([*mounted, "true"], capture_output=True).returncode == 0:
    told(doctor("--cases", "full", rc=7, before=mounted), "cases", "bad", "No space left")
else:
    print("    (no mounts of one's own here: a disk that is really full is not tried)")
print("ok  folders: open to all, closed, full, a file, one in the other")

# What others would read.
os.chmod("login", 0o644)
pathlib.Path("nothing").write_text("no colon\n")
os.chmod("nothing", 0o600)
found = doctor("--login", "login,nothing,nowhere", "--metrics", f"nowhere/x.prom,{inbox}", rc=7)
told(found, "login", "bad", "others can read 'login' -> chmod 600 login")
told(found, "login", "bad", "no login", 1)
told(found, "login", "bad", "nowhere", 2)
told(found, "counters", "bad", "is not there")
told(found, "counters", "bad", "is a folder", 1)
print("ok  logins that others can read, that hold none, that are not there; counters without a folder")

# Titles, addresses, rules: several at a time, each told by itself.
for name, rule, why, flags, more in (
    (
        "cut",
        '{"osteotome_rules": 1,\n "rules": [',
        "cut.json",
        ("--ae", "SEVENTEEN_LETTERS", "--bind", "192.0.2.77"),
        (("title", "bad", "no title"), ("port", "bad", "no address of this machine")),
    ),
    (
        "key",
        '{"osteotome_rules": 1, "rules": [{"name": "a", "modalty": "CT"}]}',
        "modalty",
        ("--ae", "BACK\\SLASH", "--bind", "pacs.example"),
        (("title", "bad", "no title"), ("port", "bad", "no IPv4 address")),
    ),
    (
        "setting",
        '{"osteotome_rules": 1, "rules": [{"name": "a", "set": {"lowr": "3"}}]}',
        "did you mean",
        ("--allow", "ORTHANC,,CT", "--bind", "0.0.0.0"),
        (("title", "bad", "no title"), ("port", "care", "not encrypted")),
    ),
    (
        "pipeline",
        '{"osteotome_rules": 1, "rules": [{"name": "a", "pipeline": "gone.json"}]}',
        "gone.json",
        ("--jobs", "1000", "--memory-mb", "1000000"),
        (("machine", "bad", "fewer --jobs"),),
    ),
):
    pathlib.Path(f"{name}.json").write_text(rule)
    found = doctor("--rules", f"{name}.json", *flags, rc=7)
    for what, state, words in (("rules", "bad", why), *more):
        told(found, what, state, words)
with socket.socket() as s:
    s.bind(("127.0.0.1", 0))
    s.listen()
    told(doctor("--port", s.getsockname()[1], rc=7), "port", "bad", f"process {os.getpid()}")
node = subprocess.Popen(
    [osteo, "receive", work / "other", "--port", "0", "--json", "--allow-all", "--keep-free-gb", "0"],
    stdout=subprocess.PIPE,
    stderr=subprocess.DEVNULL,
    text=True,
)
try:
    told(
        doctor("--port", json.loads(node.stdout.readline())["listening"], rc=0),
        "port",
        "good",
        f"osteo (process {node.pid})",
    )
finally:
    node.terminate()
    node.wait()
print("ok  titles, addresses, rules, memory; a port that is taken, and one that our own node has")

# TLS.
if shutil.which("openssl"):
    for name in ("a", "b"):
        subprocess.run(
            [
                "openssl",
                "req",
                "-x509",
                "-newkey",
                "rsa:2048",
                "-nodes",
                "-keyout",
                f"{name}.key",
                "-out",
                f"{name}.pem",
                "-subj",
                "/CN=x",
                "-days",
                "2",
            ],
            check=True,
            capture_output=True,
        )
    tls = lambda key: ("--tls-ca", "a.pem", "--tls-certificate", "a.pem", "--tls-key", key)
    os.chmod("a.key", 0o600)
    told(doctor(*tls("a.key"), "--bind", "0.0.0.0", rc=0), "TLS", "good", "belong together")
    told(doctor(*tls("b.key"), rc=7), "TLS", "bad", "not the key")
    os.chmod("a.key", 0o640)
    told(doctor(*tls("a.key"), rc=7), "TLS", "bad", "chmod 600 a.key")
    print("ok  TLS: a key that others can read, and one of another certificate")

# systemd and Slurm as they would answer.
fakes = work / "fakes"
fakes.mkdir()


def fake(name, text):
    (fakes / name).write_text("#!/bin/sh\n" + text)
    (fakes / name).chmod(0o755)


def units(receive, watch="LoadState=loaded\\nActiveState=active\\nUnitFileState=enabled\\nResult=success"):
    fake("systemctl", f"case \"$*\" in *osteo-receive*) printf '{receive}\\n';; *) printf '{watch}\\n';; esac\n")
    return doctor(path=f"{fakes}:{os.environ['PATH']}")


unit = "osteo-receive.service"
state = "LoadState=loaded\\nActiveState=%s\\nUnitFileState=%s\\nResult=%s"
told(units(state % ("active", "enabled", "success")), unit, "good", "runs")
told(units(state % ("failed", "enabled", "exit-code")), unit, "bad", "exit-code -> journalctl")
told(units(state % ("inactive", "disabled", "success")), unit, "care", "enable --now")
told(units(state % ("active", "disabled", "success")), unit, "care", "next start")
found = units("LoadState=not-found\\nActiveState=inactive")
told(found, unit, "none", "not installed")
told(found, "osteo-watch.service", "good", "runs")
# Workers of Orthancs: each that systemd knows.
fake(
    "systemctl",
    "case \"$*\" in *list-units*) printf 'osteo-watch-orthanc@a.service loaded active running A\\nosteo-watch-orthanc@b.service loaded failed failed B\\n';; "
    f"*@b*) printf '{state % ('failed', 'enabled', 'exit-code')}\\n';; *) printf '{state % ('active', 'enabled', 'success')}\\n';; esac\n",
)
found = doctor(path=f"{fakes}:{os.environ['PATH']}")
told(found, "osteo-watch-orthanc@a.service", "good", "runs")
told(found, "osteo-watch-orthanc@b.service", "bad", "exit-code -> journalctl -u osteo-watch-orthanc@b.service")
fake("systemctl", "echo 'System has not been booted with systemd' >&2; exit 1")
found = doctor(path=str(fakes))
told(found, "systemd", "none", "no systemd")
told(found, "Slurm", "none", "this machine alone")
fake("sbatch", "")
told(doctor(path=str(fakes)), "Slurm", "none", "not snakemake scontrol")
fake("scontrol", "")
fake("snakemake", "")
told(doctor(path=str(fakes)), "Slurm", "good", "snakemake sbatch scontrol")
print("ok  units that run, failed, rest and are not installed; Slurm there, in part and not")

r = subprocess.run([osteo, "doctor", "--inbox", inbox], capture_output=True, text=True)
assert r.returncode == 2 and "--server" in r.stderr, (r.returncode, r.stderr)
print("doctor --server: all told")
