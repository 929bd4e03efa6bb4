"""A server's data saved by tar, lost, and restored, in its place and on another machine: nothing is prepared again, and cases, approvals and sessions
are as they were. usage: check_backup.py BIN_DIR WORK_DIR SOURCE_DIR"""

import hashlib, json, os, pathlib, shutil, subprocess, sys

bin_dir, work, source = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
RULES = source / "pipelines/rules.json"


class Machine:
    """A server and whose home its services have."""

    def __init__(self, root):
        self.root = root
        self.data, self.home = root / "srv", root / "home"
        self.cases = self.data / "CASES"

    def run(self, *args, code=0):
        env = os.environ | {"HOME": str(self.home), "XDG_STATE_HOME": str(self.home / ".local/state")}
        done = subprocess.run(
            [bin_dir / "osteo", *map(str, args)], capture_output=True, text=True, env=env, cwd=self.root
        )
        assert done.returncode == code, (args, done.returncode, done.stderr)
        return done.stdout

    def watch(self):
        flags = ("--rules", RULES, "-o", self.cases, "--once", "--quiet-s", 0.1, "--json", "--quiet")
        return [json.loads(line) for line in self.run("watch-folder", self.data / "INBOX", *flags).splitlines() if line]

    def files(self):
        """Content by name, of all that is kept."""
        return {
            p.relative_to(self.root).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
            for folder in (self.data, self.home)
            for p in sorted(folder.rglob("*"))
            if p.is_file()
        }

    def only_case(self):
        (case,) = (p for p in (self.cases / "cases").iterdir() if p.is_dir())
        return case


first = Machine(work / "first")
(first.data / "INBOX").mkdir(parents=True)
first.home.mkdir()
first.run("phantom", first.data / "INBOX/scan", "--region", "temporal", "--spacing-mm", 1.5, "--quiet")
# Like a scanner's: the phantom's own maker and description match no rule.
try:
    import pydicom
except ImportError as e:
    print(f"skipped: {e}")
    sys.exit(77)
for f in (first.data / "INBOX/scan").iterdir():
    d = pydicom.dcmread(f)
    d.Manufacturer, d.SeriesDescription, d.SliceThickness = "Scanners", "Temporal bone 0.6 H60", "0.6"
    d.save_as(f)
print("first run:", first.watch())
case = first.only_case()
first.run("approve", case, "--by", "A. Miller", "--note", "seen")
script = source / "pipelines/sessions/mastoid.json"
first.run("rehearse", case, "--headless", "--fast", "--script", script, "-o", case / "sessions/one", "--quiet")
was = first.files()
first.watch()
assert first.files() == was, "a second run has nothing to do, and leaves nothing"

subprocess.run(["tar", "-C", first.root, "-cf", work / "backup.tar", "srv", "home"], check=True)
shutil.rmtree(first.root)

# In its place, and on another machine, whose folders lie elsewhere.
for machine in (first, Machine(work / "second")):
    machine.root.mkdir()
    subprocess.run(["tar", "-C", machine.root, "-xf", work / "backup.tar"], check=True)
    assert machine.files() == was
    machine.watch()
    assert machine.files() == was, "what was done before the backup is not done again"
    case = machine.only_case()
    assert "A. Miller" in machine.run("info", case)
    replayed = json.loads(machine.run("replay", case / "sessions/one", "--case-folder", case, "--json", "--quiet"))
    assert replayed["identical"], replayed
    machine.run("report", case, "--scan", machine.data / "INBOX/scan", "--quiet")
    print(
        f"ok  restored to {machine.root.name}: {len(was)} files, no case made again, approval and session as they were"
    )

# A backup without the records: the scan runs again, into a case of its own, and the old one stays.
shutil.rmtree(first.root)
first.root.mkdir()
subprocess.run(["tar", "-C", first.root, "-xf", work / "backup.tar", "--exclude", "srv/CASES/records"], check=True)
first.watch()
made = sorted(p.name for p in (first.cases / "cases").iterdir() if p.is_dir())
assert len(made) == 2 and made[1] == made[0] + "-2", made
assert all(first.files()[n] == h for n, h in was.items() if n.startswith("srv/CASES/cases")), "no case is replaced"
print("ok  without records:", made)
