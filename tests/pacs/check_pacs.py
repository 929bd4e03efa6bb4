"""send, fetch and receive against programs nobody here wrote: Orthanc, DCMTK's storescu and echoscu; then against peers that lie.
usage: check_pacs.py PART BIN WORK, with PART orthanc, hostile, watch, doors, dicomweb, dicomweb_lies, tls or units"""

import base64, contextlib, http.server, io, json, os, pathlib, re, shlex, shutil, signal, socket, ssl, struct, subprocess, sys, threading, time, urllib.parse, urllib.request, warnings

if missing := [
    p
    for p in ("Orthanc", "storescu", "echoscu", "openssl")
    if not shutil.which(p, path=os.environ["PATH"] + ":/usr/sbin")
]:
    print(f"skipped: {', '.join(missing)} not installed (Debian: orthanc, dcmtk, openssl)")
    sys.exit(77)
try:
    import highdicom, pydicom
except ImportError as e:
    print(f"skipped: {e}")
    sys.exit(77)
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from free_port import free_port

part, bin_dir, work = sys.argv[1], *(pathlib.Path(a).resolve() for a in sys.argv[2:4])
osteo = bin_dir / "osteo"
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.environ["PATH"] += ":/usr/sbin"  # where Debian has Orthanc
os.chdir(work)


def run(*args, rc=0):
    r = subprocess.run([str(a) for a in args], capture_output=True, text=True)
    assert r.returncode == rc, (args, r.returncode, r.stdout[-2000:], r.stderr[-2000:])
    return r


def until(what, seconds=120):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if (got := what()) is not None and got is not False:
            return got
        time.sleep(0.1)
    raise AssertionError(f"waited in vain: {what.__doc__ or what}")


class Receiver:
    def __init__(self, folder, *flags):
        self.folder = work / folder
        self.log = open(work / f"{folder}.log", "w")
        self.process = subprocess.Popen(
            [osteo, "receive", self.folder, "--port", "0", "--json", "--keep-free-gb", "0", *flags],
            stdout=subprocess.PIPE,
            stderr=self.log,
            text=True,
        )
        self.port = json.loads(self.process.stdout.readline())["listening"]

    def closed(self):
        return json.loads(self.process.stdout.readline())

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(60) in (0, 130), self.process.returncode

    def objects(self):
        return sorted(self.folder.glob("study-*/series-*/*.dcm"))

    def incoming(self):
        return list((self.folder / ".incoming").iterdir())


def make_scan():
    run(osteo, "phantom", "ct", "--region", "temporal", "--spacing-mm", "2", "--quiet")
    files = sorted(p for p in (work / "ct").rglob("*") if p.is_file())
    assert len(files) > 10, files
    return files


def data_set(path):
    """What lies behind the file meta information: a node may write its own."""
    raw = pathlib.Path(path).read_bytes()
    meta = pydicom.filereader.read_file_meta_info(path)
    return raw[144 + meta.FileMetaInformationGroupLength :]


def ct_series(ask):
    return next(i for i in ask("/series") if ask(f"/series/{i}")["MainDicomTags"]["Modality"] == "CT")


@contextlib.contextmanager
def orthanc(dicom, http, receiver_port, login=None, plugins=()):
    folder = work / "orthanc"
    config = {
        "StorageDirectory": str(folder),
        "IndexDirectory": str(folder),
        "HttpPort": http,
        "DicomPort": dicom,
        "DicomAet": "ORTHANC",
        "RemoteAccessAllowed": False,
        "AuthenticationEnabled": False,
        "DicomCheckCalledAet": True,
        "DicomAlwaysAllowStore": False,
        "DicomAlwaysAllowEcho": False,
        "DicomAlwaysAllowFind": False,
        "DicomAlwaysAllowGet": False,
        "Plugins": [str(p) for p in plugins],
        "DicomModalities": {
            "osteotome": {
                "AET": "OSTEOTOME",
                "Host": "127.0.0.1",
                "Port": receiver_port,
                "AllowEcho": True,
                "AllowFind": True,
                "AllowGet": True,
                "AllowMove": True,
                "AllowStore": True,
            }
        },
    }
    if login:
        config |= {"AuthenticationEnabled": True, "RegisteredUsers": dict([login.split(":")]), "StableAge": 1}
    headers = {"Authorization": "Basic " + base64.b64encode(login.encode()).decode()} if login else {}
    (work / "orthanc.json").write_text(json.dumps(config))
    with open(work / "orthanc.log", "w") as log:
        process = subprocess.Popen(["Orthanc", "orthanc.json"], stdout=log, stderr=log)
        try:

            def up():
                try:
                    return (
                        urllib.request.urlopen(
                            urllib.request.Request(f"http://127.0.0.1:{http}/system", headers=headers), timeout=5
                        ).status
                        == 200
                    )
                except OSError:
                    return False

            until(up)
            yield lambda path, data=None: json.load(
                urllib.request.urlopen(
                    urllib.request.Request(
                        f"http://127.0.0.1:{http}{path}",
                        data=None if data is None else data if isinstance(data, bytes) else json.dumps(data).encode(),
                        headers=headers,
                    ),
                    timeout=120,
                )
            )
        finally:
            process.terminate()
            process.wait(60)


def round_trip():
    files = make_scan()
    n = len(files)
    (work / "ct" / "notes.txt").write_text("no object")
    receiver = Receiver("inbox", "--allow", "ORTHANC", "--quiet-s", "2")
    dicom, http = free_port(), free_port()
    peer = f"ORTHANC@127.0.0.1:{dicom}"
    with orthanc(dicom, http, receiver.port) as ask:
        dry = json.loads(run(osteo, "send", "ct", "--peer", peer, "--dry-run", "--json").stdout)
        assert (
            dry["kinds"][0]["objects"] == n and dry["kinds"][0]["kind"] == "CT Image Storage" and dry["set_aside"] == 1
        ), dry
        assert ask("/instances") == [], "dry means dry"
        begin = time.monotonic()
        sent = json.loads(run(osteo, "send", "ct", "--peer", peer, "--json", "--quiet").stdout)
        print(f"send: {n} slices in {time.monotonic() - begin:.2f} s")
        assert (sent["objects"], sent["accepted"], sent["safe"], sent["checked"]) == (n, n, n, True), sent
        assert len(ask("/instances")) == n
        # What is made of it goes to the same study: a segmentation and a surface, each under a presentation context of its own.
        run(osteo, "import", "ct", "ct.nrrd", "--quiet")
        run(osteo, "threshold", "ct.nrrd", "mask.nrrd", "--lower", "300", "--quiet")
        run(osteo, "resample", "ct.nrrd", "mask.nrrd", "bone.vdb", "--quiet")
        run(osteo, "surface", "bone.vdb", "bone.stl", "--quiet")
        (work / "results").mkdir()
        for name in ("mask.nrrd", "bone.stl"):
            run(osteo, "convert", name, f"results/{name[:4]}.dcm", "--source", "ct", "--quiet")
        sent = json.loads(run(osteo, "send", "results", "--peer", peer, "--json", "--quiet").stdout)
        assert sent["safe"] == 2 and len(ask("/studies")) == 1, sent
        assert sorted(ask(f"/series/{i}")["MainDicomTags"]["Modality"] for i in ask("/series")) == ["CT", "M3D", "SEG"]
        # Titles: ours unknown to it, its own wrong.
        r = run(osteo, "send", "ct", "--peer", peer, "--ae", "NOBODY", rc=7)
        assert "rejects NOBODY" in r.stderr, r.stderr
        r = run(osteo, "send", "ct", "--peer", f"WRONG@127.0.0.1:{dicom}", rc=7)
        assert "WRONG" in r.stderr and "rejects OSTEOTOME" in r.stderr, r.stderr
        r = run(osteo, "send", "ct", "--peer", f"ORTHANC@127.0.0.1:{free_port()}", "--timeout-s", "5", rc=7)
        assert "cannot be reached" in r.stderr, r.stderr
        run(osteo, "send", "mask.nrrd", "--peer", peer, rc=3)
        # What it has, and back.
        head = pydicom.dcmread(files[0], stop_before_pixels=True)
        run(osteo, "fetch", "--peer", peer, rc=2)
        run(osteo, "fetch", "--peer", peer, "--study", "1.2.3.4.5", rc=3)
        run(osteo, "fetch", "--peer", peer, "--study", "1.2*", rc=2)
        listed = json.loads(
            run(osteo, "fetch", "--peer", peer, "--study", head.StudyInstanceUID, "--modality", "CT", "--json").stdout
        )
        assert [(s["series"], s["images"], s["modality"]) for s in listed] == [
            (head.SeriesInstanceUID, n, "CT")
        ], listed
        begin = time.monotonic()
        got = json.loads(
            run(
                osteo,
                "fetch",
                "--peer",
                peer,
                "--series",
                head.SeriesInstanceUID,
                "--study",
                head.StudyInstanceUID,
                "-o",
                "back",
                "--json",
                "--quiet",
            ).stdout
        )
        print(f"fetch: {got['images']} slices in {time.monotonic() - begin:.2f} s")
        assert got["images"] == n
        uid = lambda p: pydicom.dcmread(p, stop_before_pixels=True).SOPInstanceUID
        ours = {uid(p): data_set(p) for p in files}
        assert {uid(p): data_set(p) for p in (work / "back").iterdir()} == ours, "bit for bit"
        run(
            osteo,
            "fetch",
            "--peer",
            peer,
            "--series",
            head.SeriesInstanceUID,
            "--study",
            head.StudyInstanceUID,
            "-o",
            "back",
            rc=6,
        )
        r = run(
            osteo,
            "fetch",
            "--peer",
            peer,
            "--series",
            head.SeriesInstanceUID,
            "--study",
            head.StudyInstanceUID,
            "-o",
            "small",
            "--series-gb",
            "0.0001",
            rc=9,
        )
        assert not (work / "small").exists() and "larger than allowed" in r.stderr, r.stderr
        r = run(osteo, "fetch", "--peer", peer, "--study", head.StudyInstanceUID, "-o", "all", rc=2)
        assert "3 series match" in r.stderr, r.stderr
        run(osteo, "import", "back", "back.nrrd", "--quiet")
        (seg,) = (
            s["series"]
            for s in json.loads(
                run(
                    osteo, "fetch", "--peer", peer, "--study", head.StudyInstanceUID, "--modality", "SEG", "--json"
                ).stdout
            )
        )
        run(osteo, "fetch", "--peer", peer, "--study", head.StudyInstanceUID, "--series", seg, "-o", "seg", "--quiet")
        assert highdicom.seg.segread(work / "seg" / "000001.dcm").number_of_segments == 1
        # It sends to us.
        begin = time.monotonic()
        moved = ask("/modalities/osteotome/store", ct_series(ask))
        print(f"receive: {n} slices in {time.monotonic() - begin:.2f} s")
        assert moved["FailedInstancesCount"] == 0 and moved["InstancesCount"] == n, moved
        closed = receiver.closed()
        assert closed["objects"] == n, closed
        assert {uid(p): data_set(p) for p in receiver.objects()} == ours, "bit for bit"
        assert head.StudyInstanceUID not in str(receiver.objects()[0]), "no UID in a name"
        run(osteo, "import", closed["closed"], "received.nrrd", "--quiet")
        # The same again: nothing new, no error; a late slice opens the series again.
        moved = ask("/modalities/osteotome/store", ct_series(ask))
        assert moved["FailedInstancesCount"] == 0 and len(receiver.objects()) == n
        late = pydicom.dcmread(files[0])
        late.SOPInstanceUID = late.file_meta.MediaStorageSOPInstanceUID = late.SOPInstanceUID + ".1"
        late.save_as("late.dcm", enforce_file_format=True)
        run(osteo, "send", "late.dcm", "--peer", peer, "--quiet")
        ask(
            "/modalities/osteotome/store",
            [
                i
                for i in ask("/instances")
                if ask(f"/instances/{i}")["MainDicomTags"]["SOPInstanceUID"] == late.SOPInstanceUID
            ][0],
        )
        assert receiver.closed()["objects"] == n + 1
        # Our own work comes back from there with the scan: none of it runs, or results would make results without end.
        moved = ask("/modalities/osteotome/store", ask("/studies")[0])
        assert moved["FailedInstancesCount"] == 0, moved
        told = [
            json.loads(text)
            for text in run(
                osteo,
                "watch-folder",
                "inbox",
                "--rules",
                pathlib.Path(__file__).resolve().parents[2] / "pipelines" / "rules.json",
                "-o",
                "watched",
                "--once",
                "--quiet-s",
                "0.1",
                "--json",
                "--quiet",
            ).stdout.splitlines()
        ]
        assert sorted((e["what"], e["objects"]) for e in told) == [
            ("unmatched", 1),
            ("unmatched", 1),
            ("unmatched", n + 1),
        ], told
    receiver.stop()


def hostile():
    warnings.simplefilter("ignore")  # of values that are wrong on purpose
    files = make_scan()
    storescu = lambda port, *paths, calling="PEER", called="OSTEOTOME", rc=None: subprocess.run(
        ["storescu", "-aet", calling, "-aec", called, "127.0.0.1", str(port), *map(str, paths)],
        capture_output=True,
        text=True,
    )
    r = run(osteo, "receive", "x", rc=2)
    assert "nobody may send" in r.stderr, r.stderr
    run(osteo, "receive", "x", "--allow", "A\\B", rc=2)
    run(osteo, "receive", "x", "--allow-all", "--bind", "localhost", rc=2)
    node = Receiver(
        "inbox",
        "--allow",
        "PEER",
        "--quiet-s",
        "1",
        "--associations",
        "8",
        "--object-gb",
        "0.002",
        "--timeout-s",
        "3",
        "--metrics",
        "metrics.txt",
    )
    counter = lambda name: (
        next(
            (
                int(line.split()[1])
                for line in pathlib.Path("metrics.txt").read_text().splitlines()
                if line.startswith(f"osteotome_receive_{name}_total ")
            ),
            0,
        )
        if pathlib.Path("metrics.txt").exists()
        else 0
    )
    memory = lambda: int(
        next(
            line
            for line in pathlib.Path(f"/proc/{node.process.pid}/status").read_text().splitlines()
            if line.startswith("VmRSS")
        ).split()[1]
    )
    # It listens on this machine alone.
    listening = subprocess.run(["cat", "/proc/net/tcp"], capture_output=True, text=True).stdout
    assert f"0100007F:{node.port:04X}" in listening and f"00000000:{node.port:04X}" not in listening
    assert subprocess.run(["echoscu", "-aet", "PEER", "-aec", "OSTEOTOME", "127.0.0.1", str(node.port)]).returncode == 0
    # Titles.
    for calling, called in (("NOBODY", "OSTEOTOME"), ("PEER", "OTHER"), ("peer", "OSTEOTOME")):
        assert storescu(node.port, files[0], calling=calling, called=called).returncode != 0
    assert node.objects() == []
    # One that is good, before and after all that follows.
    assert storescu(node.port, files[0]).returncode == 0 and len(node.objects()) == 1
    node.closed()
    before = memory()

    def changed(name, **values):
        d = pydicom.dcmread(files[1])
        for key, value in values.items():
            setattr(d, key, value)
            if key == "SOPInstanceUID":
                d.file_meta.MediaStorageSOPInstanceUID = value
        d.save_as(name, enforce_file_format=False)
        return name

    # Tricks with UIDs, in each of them.
    pydicom.config.settings.writing_validation_mode = pydicom.config.IGNORE
    tricks = [
        ("SOPInstanceUID", "../../../../tmp/evil"),
        ("StudyInstanceUID", "../../../evil"),
        ("SeriesInstanceUID", "/etc/evil"),
        ("StudyInstanceUID", ""),
        ("SOPInstanceUID", "1.2..3"),
        ("SeriesInstanceUID", "1" * 65),
    ]
    for n, (key, value) in enumerate(tricks):
        storescu(node.port, changed(f"trick-{n}.dcm", **{key: value}))
    # Another object under a UID that is there.
    other = pydicom.dcmread(files[0])
    other.PixelData = bytes(len(other.PixelData))
    other.save_as("other.dcm")
    original = node.objects()[0].read_bytes()
    said = storescu(node.port, "other.dcm")
    assert len(node.objects()) == 1 and node.objects()[0].read_bytes() == original, "never written over"
    # Larger than allowed.
    large = pydicom.dcmread(files[2])
    large.PixelData = bytes(4_000_000)
    large.save_as("large.dcm")
    storescu(node.port, "large.dcm")
    assert len(node.objects()) == 1, [p.stat().st_size for p in node.objects()]

    def talk(data, wait=0.0, close=True):
        s = socket.create_connection(("127.0.0.1", node.port), timeout=10)
        with contextlib.suppress(OSError):
            s.sendall(data)
            time.sleep(wait)
            if close:
                s.shutdown(socket.SHUT_WR)
                while s.recv(4096):
                    pass
        if close:
            s.close()
        return s

    def request(called=b"OSTEOTOME", calling=b"PEER", items=b""):
        if not items:
            syntax = b"1.2.840.10008.1.2.1"
            item = lambda kind, body: struct.pack(">BBH", kind, 0, len(body)) + body
            items = (
                item(0x10, b"1.2.840.10008.3.1.1.1")
                + item(0x20, b"\x01\0\0\0" + item(0x30, b"1.2.840.10008.5.1.4.1.1.2") + item(0x40, syntax))
                + item(0x50, item(0x51, struct.pack(">I", 16384)) + item(0x52, b"1.2.3"))
            )
        body = struct.pack(">HH", 1, 0) + called.ljust(16) + calling.ljust(16) + bytes(32) + items
        return struct.pack(">BBI", 1, 0, len(body)) + body

    talk(b"")
    talk(b"GET / HTTP/1.1\r\n\r\n")
    talk(os.urandom(10000))
    talk(struct.pack(">BBI", 1, 0, 0xFFFFFFFF) + bytes(1000))  # says it is 4 GB long
    talk(struct.pack(">BBI", 4, 0, 0x7FFFFFFF) + bytes(100000))
    good = request()
    for cut in (1, 5, 6, 40, 74, len(good) - 1):
        talk(good[:cut])
    talk(request(called=b"\xff" * 16))
    talk(request(items=struct.pack(">BBH", 0x20, 0, 65535) + bytes(100)))
    talk(
        good + struct.pack(">BBI", 4, 0, 12) + struct.pack(">IBB", 0xFFFFFFF0, 1, 3) + bytes(6)
    )  # a length that does not fit
    talk(
        good
        + b"".join(
            struct.pack(">BBI", 4, 0, 106) + struct.pack(">IBB", 102, 1, 1) + os.urandom(100) for _ in range(2000)
        ),
        0.2,
    )  # commands without end
    # A dataset that says it is 100 GB, and one of sequences within sequences.
    deep = pydicom.dcmread(files[3])
    inner = pydicom.Dataset()
    for _ in range(200):
        outer = pydicom.Dataset()
        outer.RequestAttributesSequence = [inner]
        inner = outer
    deep.RequestAttributesSequence = [inner]
    deep.save_as("deep.dcm")
    storescu(node.port, "deep.dcm")
    # Two hundred at once who say nothing: some are told that it is busy, and they are gone after their time.
    idle = [talk(b"", close=False) for _ in range(200)]
    until(lambda: counter("refused_associations") >= 190)
    children = lambda: len(
        subprocess.run(["pgrep", "-P", str(node.process.pid)], capture_output=True, text=True).stdout.split()
    )
    assert children() <= 8, children()
    until(lambda: children() == 0)
    for s in idle:
        s.close()
    # A thousand connections that are given up.
    for _ in range(1000):
        socket.create_connection(("127.0.0.1", node.port), timeout=10).close()
    until(lambda: children() == 0)
    assert storescu(node.port, *files[4:8]).returncode == 0, "it still serves"
    kept = len(node.objects())
    assert kept in (5, 6), kept  # deep.dcm is a right one, if deep
    until(lambda: node.closed()["objects"] == kept)
    assert node.incoming() == [], "nothing half is left"
    assert memory() < before + 20_000, (before, memory())
    until(lambda: counter("stored") == kept)
    assert counter("refused") >= 4, pathlib.Path("metrics.txt").read_text()
    inside = {p.parent.parent.parent for p in work.rglob("*.dcm") if p.parent.name.startswith("series-")}
    assert inside == {node.folder} and not pathlib.Path("/tmp/evil").exists() and not list(work.parent.glob("*evil*"))
    node.stop()
    # Killed while a slice comes in: the next start clears it away, and closes what was still open.
    for closed in node.folder.glob("study-*/series-*/CLOSED"):
        closed.unlink()
    (node.folder / ".incoming" / "1-0").write_bytes(b"half")
    again = Receiver("inbox", "--allow-all", "--quiet-s", "1", "--folder-gb", "0.00001")
    assert again.incoming() == [] and again.closed()["objects"] == kept
    storescu(again.port, files[9])
    assert len(again.objects()) == kept, "the folder is as large as it may be"
    again.stop()


def watch():
    files = make_scan()
    warnings.simplefilter("ignore")
    rules = {
        "osteotome_rules": 1,
        "rules": [
            {"name": "overviews", "any_of": ["topogram"], "ignore": True},
            {
                "name": "ear",
                "modality": "CT",
                "any_of": ["petrous"],
                "slice_mm": [0.1, 3],
                "least_objects": 5,
                "set": {"spacing_mm": "3", "lower": "300"},
            },
        ],
    }
    (work / "rules.json").write_text(json.dumps(rules))
    (work / "wrong.json").write_text(json.dumps(rules).replace("spacing_mm", "spacing_m"))
    inbox, out = work / "inbox", work / "out"
    inbox.mkdir()

    def series(folder, uid, description="Petrous bone", modality="CT", of=files):
        (inbox / folder).mkdir(exist_ok=True)
        for n, path in enumerate(of):
            d = pydicom.dcmread(path)
            d.SeriesInstanceUID, d.SeriesDescription, d.Modality, d.SliceThickness = uid, description, modality, "2"
            d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"{uid}.{d.InstanceNumber}"
            d.PatientName = "WATCHED^PERSON"
            d.save_as(inbox / folder / f"{uid}-{n}.dcm")

    line = [
        osteo,
        "watch-folder",
        inbox,
        "--rules",
        "rules.json",
        "-o",
        out,
        "--quiet-s",
        "0.5",
        "--poll-s",
        "0.2",
        "--json",
        "--no-report",
        "--keep-free-mb",
        "0",
    ]
    events = lambda *more, rc=0: [
        json.loads(text) for text in run(*line, "--once", "--quiet", *more, rc=rc).stdout.splitlines()
    ]
    what = lambda told: sorted(e["what"] for e in told)
    # What is wrong is told before anything is made.
    r = run(osteo, "watch-folder", inbox, "--rules", "wrong.json", "-o", out, rc=2)
    assert "spacing_m" in r.stderr and "spacing_mm" in r.stderr and not out.exists(), r.stderr
    (work / "value.json").write_text(json.dumps(rules).replace('"spacing_mm": "3"', '"spacing_mm": "many"'))
    r = run(osteo, "watch-folder", inbox, "--rules", "value.json", "-o", out, rc=2)
    assert "rule 'ear': spacing_mm" in r.stderr and not out.exists(), r.stderr
    run(osteo, "watch-folder", inbox, "-o", out, rc=2)
    run(osteo, "watch-folder", inbox, "--rules", "rules.json", "-o", inbox / "out", rc=2)
    run(osteo, "watch-folder", work / "nowhere", "--rules", "rules.json", "-o", out, rc=3)
    run(osteo, "watch-folder", inbox, "--rules", "rules.json", "-o", work / "ct", rc=6)
    # A good one; one to ignore, one without a rule, our own, a file that is no object, and a hidden one.
    series("a", "1.2.3.1", of=files[:-1])
    series("b", "1.2.3.2", "Topogram", of=files[:1])
    series("c", "1.2.3.3", "Petrous bone", "MR", of=files[:1])
    (inbox / "own").mkdir()
    shutil.copy(files[0], inbox / "own")
    (inbox / "a" / "notes.txt").write_text("no object")
    (inbox / ".half").write_bytes(b"half")
    told = events("--metrics", "watch.prom")
    assert what(told) == ["begun", "done", "ignored", "unmatched", "unmatched"], told
    done = next(e for e in told if e["what"] == "done")
    assert (done["rule"], done["objects"]) == ("ear", len(files) - 1) and (
        pathlib.Path(done["case"]) / "manifest.json"
    ).exists(), done
    assert {e["why"] for e in told if e["what"] == "unmatched"} == {
        "made by this program",
        "'overviews': its description has none of the words; 'ear': another modality than CT",
    }, told
    assert "osteotome_watch_done_total 1\n" in (work / "watch.prom").read_text()
    # The same again, also with other times: nothing. What no rule has is told again, since rules may have changed.
    (inbox / "a" / next(iter(sorted(os.listdir(inbox / "a"))))).touch()
    assert what(events()) == ["ignored", "unmatched", "unmatched"]
    # A late slice: another case beside the first, which stays as it is.
    before = {p: p.read_bytes() for p in pathlib.Path(done["case"]).rglob("*") if p.is_file()}
    series("late", "1.2.3.1", of=files[-1:])
    again = next(e for e in events() if e["what"] == "done")
    assert again["case"] == done["case"] + "-2" and again["objects"] == len(files), again
    assert before == {p: p.read_bytes() for p in before}
    assert len(list((out / "sources" / pathlib.Path(again["case"]).name).iterdir())) == len(files), "of two folders"
    shutil.rmtree(inbox / "late")
    assert "begun" not in what(events()), "taken away is nothing new"
    # Killed as soon as it begins, twice: the same case, once.
    series("d", "1.2.3.4")
    for _ in range(2):
        with subprocess.Popen([str(a) for a in line] + ["--quiet"], stdout=subprocess.PIPE, text=True) as watcher:
            until(lambda: json.loads(watcher.stdout.readline())["what"] in ("begun", "done"))
            watcher.kill()
    told = events()
    made = sorted(p.name for p in (out / "cases").iterdir() if p.is_dir())
    (ended,) = (name for name in made if not name.startswith(pathlib.Path(done["case"]).name))
    assert len(made) == 3 and (out / "cases" / ended / "manifest.json").exists(), made
    assert json.loads((out / "records" / f"{ended}.json").read_text())["state"] == "done"
    # Two at once into one folder: the second gives up.
    with subprocess.Popen([str(a) for a in line], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as watcher:
        watcher.stdout.readline()
        assert "another watcher" in run(*line, "--once", rc=6).stderr
        watcher.terminate()
    # One that fails is told, with an exit code, and not tried for ever.
    series("e", "1.2.3.5", of=files[:6])
    for path in (inbox / "e").iterdir():
        d = pydicom.dcmread(path)
        del d.PixelData
        d.save_as(path)
    assert "refused" in what(events(rc=8))
    assert "begun" not in what(events())
    # No identity in the journal, nor in what was said.
    for path in (out / "records").iterdir():
        assert not any(word in path.read_text() for word in ("WATCHED", "1.2.3.", "Petrous")), path


def doors():
    """watch --orthanc: against Orthanc with a password, then against a server that lies."""
    files = make_scan()
    warnings.simplefilter("ignore")
    rules = {
        "osteotome_rules": 1,
        "rules": [
            {
                "name": "ear",
                "modality": "CT",
                "any_of": ["petrous"],
                "least_objects": 5,
                "set": {"spacing_mm": "3", "lower": "300"},
            }
        ],
    }
    (work / "rules.json").write_text(json.dumps(rules))

    def objects(uid, of=files, modality="CT", own=False):
        for path in of:
            d = pydicom.dcmread(path)
            d.SeriesInstanceUID, d.Modality = uid, modality
            if not own:
                d.SeriesDescription, d.Manufacturer = "Petrous bone", "SOMEBODY"
            d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"{uid}.{d.InstanceNumber}"
            d.PatientName = "WATCHED^PERSON"
            d.save_as("one.dcm", enforce_file_format=True)
            yield (work / "one.dcm").read_bytes()

    secret = "watcher:tell-nobody"
    (work / "login").write_text(secret + "\n")
    (work / "login").chmod(0o600)
    (work / "open").write_text(secret)
    (work / "open").chmod(0o644)
    (work / "bad").write_text("watcher:wrong")
    (work / "bad").chmod(0o600)
    dicom, http_port = free_port(), free_port()
    url = f"http://127.0.0.1:{http_port}"
    line = lambda folder, out, address=url, login="login": [
        osteo,
        "watch-folder",
        work / folder,
        "--rules",
        "rules.json",
        "-o",
        work / out,
        "--orthanc",
        address,
        "--orthanc-login",
        login,
        "--quiet-s",
        "0.5",
        "--poll-s",
        "0.2",
        "--json",
        "--no-report",
        "--keep-free-mb",
        "0",
        "--timeout-s",
        "2",
    ]
    said = []

    def events(*a, rc=0, more=(), **k):
        r = run(*line(*a, **k), "--once", *more, rc=rc)
        said.append(r.stdout + r.stderr)
        return [json.loads(text) for text in r.stdout.splitlines()] if rc == 0 else [], r.stdout + r.stderr

    what = lambda told: sorted(e["what"] for e in told)
    # What is wrong is told before anything is made.
    for address, login, word in (
        ("ftp://x", "login", "http"),
        ("http://a:b@127.0.0.1:1", "login", "user"),
        ("http://example.org", "login", "in the clear"),
        (url, "open", "others can read"),
        ("http://", "login", "no address"),
    ):
        r = run(*line("x", "y", address, login), "--once", rc=2)
        assert (
            word in r.stderr and "a:b" not in r.stderr and not (work / "x").exists() and not (work / "y").exists()
        ), r.stderr
    for pair in (("x", "x"), ("x", "x/y"), ("x/y", "x")):
        assert "may not lie in" in run(*line(*pair), "--once", rc=2).stderr and not (work / "x").exists(), pair
    run(*line("ct", "y"), "--once", rc=6)
    # Nobody there: told, and once means once.
    assert "Could" in events("spool", "cases", rc=7)[1] or "connect" in said[-1], said[-1]
    with orthanc(dicom, http_port, free_port(), secret) as ask:

        def store(*a, **k):
            for data in objects(*a, **k):
                ask("/instances", data)

        stable = lambda: [c for c in ask("/changes?limit=1000")["Changes"] if c["ChangeType"] == "StableSeries"]
        assert "rejects the login" in events("spool", "cases", login="bad", rc=7)[1]
        store("1.2.3.1", of=files[:-1])
        store("1.2.3.2", of=files[:1], own=True)
        store("1.2.3.3", of=files[:1], modality="MG")
        until(lambda: len(stable()) == 3)
        told, _ = events("spool", "cases")
        assert what(told) == ["begun", "done", "unmatched"], told
        done = next(e for e in told if e["what"] == "done")
        assert done["objects"] == len(files) - 1
        got = [p for p in (work / "spool").rglob("*.dcm")]
        assert sorted(data_set(p) for p in got if len(list(p.parent.iterdir())) > 1) == sorted(
            ask_bytes(http_port, secret, i) for i in ask(f"/series/{ct_series_of(ask, '1.2.3.1')}")["Instances"]
        ), "bit for bit"
        assert (work / "spool").stat().st_mode & 0o77 == 0 and all(p.stat().st_mode & 0o77 == 0 for p in got)
        assert "begun" not in what(events("spool", "cases")[0]), "once"
        # A late slice: all of the series again, into a case of its own.
        store("1.2.3.1", of=files[-1:])
        until(
            lambda: any(c["Seq"] > json.loads((work / "spool" / ".orthanc.json").read_text())["last"] for c in stable())
        )
        again = next(e for e in events("spool", "cases")[0] if e["what"] == "done")
        assert again["case"] == done["case"] + "-2" and again["objects"] == len(files), again
        # Killed while it fetches or runs, and started again: one case of it.
        store("1.2.3.4")
        last = json.loads((work / "spool" / ".orthanc.json").read_text())["last"]
        until(lambda: any(c["Seq"] > last for c in stable()))
        for wait in (0.05, 0.15, 0.3, 0.6):
            with subprocess.Popen(
                [str(a) for a in line("spool", "cases")], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            ) as watcher:
                time.sleep(wait)
                watcher.kill()
        events("spool", "cases")
        made = [p.name for p in (work / "cases" / "cases").iterdir() if p.is_dir() and (p / "manifest.json").exists()]
        assert len(made) == 3 and sum(name.endswith("-2") for name in made) == 1, made
        assert not [p for p in (work / "spool").iterdir() if p.name.startswith(".series")]
        # The folder is this server's.
        assert (
            "holds the series of"
            in run(*line("spool", "cases", url.replace("127.0.0.1", "localhost")), "--once", rc=6).stderr
        )
    # The same folder before a server that was set up anew: its changes are gone through from the first.
    shutil.rmtree(work / "orthanc")
    with orthanc(dicom, http_port, free_port(), secret) as ask:
        for data in objects("1.2.3.6"):
            ask("/instances", data)
        until(lambda: any(c["ChangeType"] == "StableSeries" for c in ask("/changes?limit=1000")["Changes"]))
        told, err = events("spool", "cases")
        assert "from its beginning" in err and what(told).count("done") == 1, (told, err)
    # One that lies. What it answers, by path; it is asked again until the watcher has what it needs or gives up.
    series, instance = "-".join(["0123abcd"] * 5), "-".join(["4567cdef"] * 5)
    good, *_ = objects("1.2.3.9", of=files[:1])
    truth = {
        "/changes": json.dumps(
            {"Changes": [{"ChangeType": "StableSeries", "ID": series, "Seq": 1}], "Done": True, "Last": 1}
        ).encode(),
        f"/series/{series}": json.dumps({"MainDicomTags": {"Modality": "CT"}}).encode(),
        f"/series/{series}/instances": json.dumps([{"ID": instance, "FileSize": len(good)}]).encode(),
        f"/instances/{instance}/file": good,
    }
    answers = {}

    class Liar(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            path = self.path.split("?")[0]
            body = answers.get(path, truth.get(path))
            if body == "stall":
                time.sleep(6)
                return
            status, body, length = (
                body if isinstance(body, tuple) else (200 if body is not None else 404, body or b"", None)
            )
            self.send_response(status)
            self.send_header("Content-Length", str(len(body) if length is None else length))
            if status == 302:
                self.send_header("Location", "/changes")
            self.end_headers()
            with contextlib.suppress(OSError):
                self.wfile.write(body)

        def log_message(self, *a):
            pass

    liar = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Liar)
    threading.Thread(target=liar.serve_forever, daemon=True).start()
    there = f"http://127.0.0.1:{liar.server_address[1]}"
    page = lambda changes, done=True: json.dumps({"Changes": changes, "Done": done, "Last": 1}).encode()
    file, listed = f"/instances/{instance}/file", f"/series/{series}/instances"
    lies = [
        ("/changes", b"<html>"),
        ("/changes", b"[]"),
        ("/changes", page([], False)),
        ("/changes", page([{"ChangeType": "StableSeries", "ID": "../../system", "Seq": 1}])),
        ("/changes", page([{"ChangeType": "StableSeries", "ID": series}])),
        ("/changes", page([{"ChangeType": "x", "ID": series, "Seq": s} for s in (2, 1)])),
        ("/changes", b"[" * 100000),
        ("/changes", (302, b"", None)),
        ("/changes", (500, b"no", None)),
        ("/changes", "stall"),
        ("/changes", b" " * 65_000_000),
        (listed, json.dumps([{"ID": "../x", "FileSize": 10}]).encode()),
        (listed, json.dumps([{"ID": instance, "FileSize": 1e12}]).encode()),
        (file, good[:-9]),
        (file, good + b"more"),
        (file, bytes(len(good))),
        (file, (200, good[:-9], len(good))),
        (file, "stall"),
    ]
    for n, (path, lie) in enumerate(lies):
        answers.clear()
        answers[path] = lie
        _, err = events(f"lied-{n}", f"lied-out-{n}", there, rc=7)
        spool = work / f"lied-{n}"
        assert not list(spool.rglob("*.dcm")) and json.loads((spool / ".orthanc.json").read_text())["last"] in (0, 2), (
            n,
            path,
            err,
        )
        answers.clear()  # and when it has come to its senses
        if n != 5:
            events(f"lied-{n}", f"lied-out-{n}", there)
            (one,) = spool.rglob("*.dcm")
            assert one.read_bytes() == good and json.loads((spool / ".orthanc.json").read_text())["last"] == 1, n
    # Objects that stay wrong do not hold up what comes after them.
    answers[file] = bytes(len(good))
    for rc in (7, 7, 0):
        _, err = events("stubborn", "stubborn-out", there, rc=rc)
    assert "left out" in err and json.loads((work / "stubborn" / ".orthanc.json").read_text())["last"] == 1, err
    # Away for a while: a watcher that stays asks again.
    answers.clear()
    answers["/changes"] = (500, b"", None)
    with (
        open(work / "patient.log", "w") as log,
        subprocess.Popen(
            [str(a) for a in line("patient", "patient-out", there)], stdout=subprocess.DEVNULL, stderr=log
        ) as watcher,
    ):
        until(lambda: "status 500" in (work / "patient.log").read_text())
        answers.clear()
        until(lambda: any((work / "patient").glob("series-*/*.dcm")))
        watcher.terminate()
    liar.shutdown()
    # No identity and no password in journal, state and words.
    said += [
        p.read_text()
        for p in [*(work / "cases" / "records").iterdir(), *work.glob("*/.orthanc.json"), work / "patient.log"]
    ]
    assert not any(word in text for text in said for word in ("tell-nobody", "WATCHED", "1.2.3.", "Petrous")), "told"


SECRET = "doctor:tell-nobody"


def web_door(said, root=None):
    for name, text, mode in (("login", SECRET, 0o600), ("open", SECRET, 0o644), ("bad", "doctor:wrong", 0o600)):
        (work / name).write_text(text + "\n")
        (work / name).chmod(mode)

    def web(command, *args, rc=0, at=None, login="login", timeout="60"):
        r = run(
            osteo,
            command,
            *args,
            "--dicomweb",
            at or root,
            "--timeout-s",
            timeout,
            *(["--dicomweb-login", login] if login else []),
            rc=rc,
        )
        said.append(r.stdout + r.stderr)
        return json.loads(r.stdout) if "--json" in args and rc in (0, 8) else r.stdout + r.stderr

    return web


def make_many(path):
    """130 objects of one slice, which is more than goes into one request."""
    (work / "many").mkdir()
    d = pydicom.dcmread(path)
    d.compress(pydicom.uid.RLELossless, generate_instance_uid=False)
    d.SeriesInstanceUID = "1.2.3.50"
    for i in range(130):
        d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"1.2.3.50.{i}"
        d.save_as(work / "many" / f"{i:03d}.dcm", enforce_file_format=True)


def dicomweb():
    """The report of a case as a DICOM object; send and fetch by STOW-RS, QIDO-RS and WADO-RS: against Orthanc with its plugin and a password."""
    plugin = pathlib.Path("/usr/share/orthanc/plugins/libOrthancDicomWeb.so")
    if not plugin.exists():
        print("skipped: Orthanc's DICOMweb plugin not installed (Debian: orthanc-dicomweb)")
        sys.exit(77)
    warnings.simplefilter("ignore")
    os.environ["XDG_STATE_HOME"] = str(work / "state")
    files = make_scan()
    said = []
    # A patient with a name, in a case with a report.
    for path in files:
        d = pydicom.dcmread(path)
        d.PatientName, d.PatientID, d.AccessionNumber, d.StudyDate = "WEB^PERSON", "P-47/11", "A4711", "20240131"
        d.save_as(path, enforce_file_format=True)
    head = pydicom.dcmread(files[0], stop_before_pixels=True)
    run(osteo, "prepare", "ct", "-o", "case", "--lower", "500", "--spacing-mm", "2", "--no-report", "--quiet")
    assert "names the patient" in run(osteo, "report", "case", "--dicom", "case.report.dcm").stderr
    report = pydicom.dcmread("case.report.dcm")
    assert (report.SOPClassUID, report.Modality, report.MIMETypeOfEncapsulatedDocument) == (
        "1.2.840.10008.5.1.4.1.1.104.1",
        "DOC",
        "application/pdf",
    )
    for key in ("PatientName", "PatientID", "AccessionNumber", "StudyDate", "StudyInstanceUID"):
        assert report[key].value == head[key].value, key
    assert report.SeriesInstanceUID != head.SeriesInstanceUID and report.SOPInstanceUID != head.SOPInstanceUID
    uid = lambda p: pydicom.dcmread(p, stop_before_pixels=True).SOPInstanceUID
    assert {i.ReferencedSOPInstanceUID for i in report.SourceInstanceSequence} == {uid(p) for p in files}
    assert report.EncapsulatedDocument[: report.EncapsulatedDocumentLength] == (work / "case.report.pdf").read_bytes()
    if shutil.which("dciodvfy"):
        checked = subprocess.run(["dciodvfy", "case.report.dcm"], capture_output=True, text=True)
        assert (
            "EncapsulatedPDF" in checked.stdout + checked.stderr and "Error" not in checked.stdout + checked.stderr
        ), checked
    again = pydicom.dcmread("case.report.dcm").SOPInstanceUID
    run(osteo, "report", "case", "--dicom", "case.report.dcm", "--quiet", rc=6)
    run(osteo, "report", "case", "--dicom", "case.report.dcm", "--quiet", "--force")
    assert uid("case.report.dcm") == again, "same pages, same object"
    run(osteo, "report", "case", "--dicom", "case.report.pdf", rc=2)
    # Never another patient's: the scan must be the one the case was made from.
    run(osteo, "phantom", "other", "--region", "temporal", "--spacing-mm", "3", "--quiet")
    assert "is not the scan" in run(osteo, "report", "case", "--scan", "other", "--dicom", "x.dcm", rc=4).stderr
    os.environ["XDG_STATE_HOME"] = str(work / "forgotten")
    assert "not at hand" in run(osteo, "report", "case", "--dicom", "x.dcm", rc=3).stderr
    run(osteo, "report", "case", "--scan", "ct", "--dicom", "y.dcm", "--quiet")
    assert uid("y.dcm") == again
    # Of several series, the one that was asked for.
    shutil.copytree("ct", "two")
    for path in files:
        d = pydicom.dcmread(path)
        d.SeriesInstanceUID, d.SeriesNumber = "1.2.3.60", 9
        d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"1.2.3.60.{d.InstanceNumber}"
        d.save_as(work / "two" / f"second-{d.InstanceNumber}.dcm", enforce_file_format=True)
    run(
        osteo,
        "prepare",
        "two",
        "-o",
        "second",
        "--series",
        "9",
        "--lower",
        "500",
        "--spacing-mm",
        "2",
        "--no-report",
        "--quiet",
    )
    run(osteo, "report", "second", "--scan", "two", "--dicom", "second.dcm", "--quiet")
    assert {i.ReferencedSOPInstanceUID for i in pydicom.dcmread("second.dcm").SourceInstanceSequence} == {
        f"1.2.3.60.{i + 1}" for i in range(len(files))
    }
    run(osteo, "import", "ct", "ct.nrrd", "--quiet")
    run(osteo, "prepare", "ct.nrrd", "-o", "plain", "--lower", "500", "--spacing-mm", "2", "--no-report", "--quiet")
    run(osteo, "report", "plain", "--dicom", "x.dcm", rc=3)
    assert not (work / "x.dcm").exists()

    dicom, http_port = free_port(), free_port()
    root = f"http://127.0.0.1:{http_port}/dicom-web/"
    web = web_door(said, root)
    study = ("--study", head.StudyInstanceUID)
    # What is wrong is told before anybody is spoken to.
    for address, login, word in (
        ("ftp://x", "login", "http"),
        ("http://a:b@127.0.0.1:1", "login", "user"),
        ("http://example.org", None, "in the clear"),
        ("http://example.org", "login", "password"),
        (root, "open", "others can read"),
        ("https://", "login", "no address"),
        ("https://x?y", "login", "no address"),
    ):
        for command in (("send", "ct"), ("fetch", *study)):
            err = web(*command, at=address, login=login, rc=2)
            assert word in err and "a:b" not in err, err
    for flags in (
        ("--dicomweb-login", "login"),
        ("--dicomweb", root, "--peer", "A@127.0.0.1:104"),
        ("--dicomweb", root, "--ae", "X"),
        ("--dicomweb", root, "--tls-ca", "ca.pem"),
        (),
    ):
        run(osteo, "send", "ct", *flags, rc=2)
        run(osteo, "fetch", *study, *flags, rc=2)
    web("fetch", rc=2)
    web("fetch", "--study", "1.2*", rc=2)
    assert "would send to " + root[:-1] in web("send", "ct", "--dry-run"), "nobody is there, and nobody is asked"
    assert "onnect" in web("send", "ct", rc=7) and "onnect" in web("fetch", *study, rc=7)
    with orthanc(dicom, http_port, free_port(), SECRET, [plugin]) as ask:
        assert "rejects the login" in web("send", "ct", login="bad", rc=7) and "asks for a login" in web(
            "fetch", *study, login=None, rc=7
        )
        assert "root of a DICOMweb" in web("fetch", *study, at=root.replace("dicom-web/", ""), rc=7)
        assert "no STOW-RS" in json.dumps(
            web("send", "ct", "--json", "--quiet", at=root.replace("dicom-web/", "nothing"), rc=8)
        )
        web("send", "ct", "--dry-run")
        assert ask("/instances") == [], "dry means dry"
        n = len(files)
        begin = time.monotonic()
        sent = web("send", "ct", "--json", "--quiet")
        print(f"STOW-RS: {n} slices in {time.monotonic() - begin:.2f} s")
        assert (sent["objects"], sent["accepted"], sent["safe"], sent["checked"], sent["peer"]) == (
            n,
            n,
            n,
            True,
            root[:-1],
        ), sent
        assert len(ask("/instances")) == n
        # The report, by both doors; then back, and read by others.
        assert web("send", "case.report.dcm", "--json", "--quiet")["safe"] == 1
        node = ("--peer", f"ORTHANC@127.0.0.1:{dicom}")
        assert json.loads(run(osteo, "send", "case.report.dcm", *node, "--json", "--quiet").stdout)["safe"] == 1
        assert len(ask("/studies")) == 1 and len(ask("/series")) == 2
        listed = web("fetch", *study, "--json")
        assert [(s["modality"], s["images"], s["number"]) for s in listed] == [("CT", n, 1), ("DOC", 1, 9003)], listed
        assert listed == json.loads(run(osteo, "fetch", *study, *node, "--json").stdout), "as C-FIND has it"
        for keys in (
            ("--patient-id", "P-47/11"),
            ("--accession", "A4711"),
            ("--date", "20240101-20241231"),
            ("--series", listed[0]["series"]),
            (*study, "--series", "1"),
            (*study, "--modality", "CT"),
        ):
            assert web("fetch", *keys, "--json", "--modality", "CT") == listed[:1], keys
        for keys in (
            ("--patient-id", "P-47"),
            ("--accession", "A"),
            ("--date", "20250101-"),
            ("--series", "1.2.3"),
            (*study, "--series", "7"),
        ):
            assert "nothing matches" in web("fetch", *keys, rc=3), keys
        begin = time.monotonic()
        assert web("fetch", *study, "--modality", "CT", "-o", "back", "--json", "--quiet")["images"] == n
        print(f"WADO-RS: {n} slices in {time.monotonic() - begin:.2f} s")
        assert {uid(p): data_set(p) for p in (work / "back").iterdir()} == {
            uid(p): data_set(p) for p in files
        }, "bit for bit"
        run(osteo, "import", "back", "back.nrrd", "--quiet")
        web("fetch", *study, "--modality", "DOC", "-o", "document", "--quiet")
        (document,) = (work / "document").iterdir()
        back = pydicom.dcmread(document)
        (work / "back.pdf").write_bytes(back.EncapsulatedDocument[: back.EncapsulatedDocumentLength])
        assert (
            back == pydicom.dcmread("case.report.dcm")
            and (work / "back.pdf").read_bytes() == (work / "case.report.pdf").read_bytes()
        )
        if shutil.which("pdftotext"):
            assert "Not a medical device" in " ".join(run("pdftotext", "back.pdf", "-").stdout.split())
        run(osteo, "fetch", *study, *node, "--modality", "DOC", "-o", "by-node", "--quiet")
        assert pydicom.dcmread(work / "by-node" / "000001.dcm") == back, "by both doors the same"
        # What was fetched stays, what is too large does not come.
        web("fetch", *study, "--modality", "CT", "-o", "back", rc=6)
        assert (
            "larger than allowed"
            in web("fetch", *study, "--modality", "CT", "-o", "small", "--series-gb", "0.0001", rc=9)
            and not (work / "small").exists()
        )
        assert "2 series match" in web("fetch", *study, "-o", "all", rc=2) and not (work / "all").exists()
        # Copies that identify nobody, through the same door.
        assert web("send", "ct", "--deidentify", "--json", "--quiet")["safe"] == n and len(ask("/studies")) == 2
        assert "each object is left out" in web("send", "case.report.dcm", "--deidentify", rc=7), "documents stay"
        # Compressed, and in more than one request.
        make_many(files[len(files) // 2])
        assert web("send", "many", "--json", "--quiet")["safe"] == 130
        web("fetch", *study, "--series", "1.2.3.50", "-o", "rle", "--quiet")
        assert {uid(p): data_set(p) for p in (work / "rle").iterdir()} == {
            uid(p): data_set(p) for p in (work / "many").iterdir()
        }, "in the form in which they are"
        # Some that are good, one that is cut, one without a head: the good ones arrive or it says that they did not.
        (work / "mixed").mkdir()
        shutil.copy(files[0], work / "mixed" / "a.dcm")
        (work / "mixed" / "b.dcm").write_bytes(data_set(files[1]))
        sent = web("send", "mixed", "--json", "--quiet", rc=8)
        assert (sent["objects"], sent["accepted"], sent["safe"]) == (2, 1, 1) and "file meta information" in sent[
            "problems"
        ][0]["problem"], sent
    assert not any(word in text for text in said for word in ("tell-nobody", "WEB^PERSON")), "told"


def dicomweb_lies():
    """A server that lies, by STOW-RS, QIDO-RS and WADO-RS. What it answers, by the end of the path."""
    warnings.simplefilter("ignore")
    files = make_scan()
    make_many(files[0])
    said = []
    web = web_door(said)
    study, series = "1.2.840.1", "1.2.840.1.5"

    def instance(n, of=series, cut=None):
        d = pydicom.dcmread(files[0])
        d.StudyInstanceUID, d.SeriesInstanceUID, d.PatientID, d.AccessionNumber = study, of, "LIED", "7"
        d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"{series}.{n}"
        to = io.BytesIO()
        d.save_as(to, enforce_file_format=True)
        return to.getvalue()[:cut]

    good = [instance(n) for n in range(3)]
    text = lambda value, vr="UI": {"vr": vr, "Value": [value]}
    as_json = lambda x: json.dumps(x).encode()
    of_study = {"0020000D": text(study), "00100020": text("LIED", "LO"), "00080050": text("7", "SH")}
    of_series = {
        "0020000D": text(study),
        "0020000E": text(series),
        "00080060": text("CT", "CS"),
        "00200011": text(4, "IS"),
        "00201209": text("3", "IS"),
        "0008103E": text("Red \x1b[31m", "LO"),
    }
    of_instances = [{"00080018": text(f"{series}.{n}")} for n in range(3)]
    MULTI = 'multipart/related; type="application/dicom"; boundary="b 0"'
    PART = b"Content-Type: application/dicom\r\n\r\n"
    multi = (
        lambda parts, head=PART, end=b"--": b"".join(b"\r\n--b 0\r\n" + head + p for p in parts) + b"\r\n--b 0" + end
    )
    truth = {
        "studies": (200, as_json([of_study]), {}),
        "series": (200, as_json([of_series]), {}),
        "instances": (200, as_json(of_instances), {}),
        series: (200, multi(good), {"Content-Type": MULTI}),
    }
    answers, posts = {}, []

    class Liar(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def answer(self, answer):
            if answer == "stall":
                time.sleep(8)
                self.close_connection = True
                return
            if answer == "hang up":
                self.close_connection = True
                self.connection.shutdown(socket.SHUT_RDWR)
                return
            status, body, headers = answer
            with contextlib.suppress(OSError):
                if headers == "endless":
                    self.wfile.write(b"HTTP/1.1 200 OK\r\n")
                    while True:
                        self.wfile.write(b"X-More: " + b"x" * 1000 + b"\r\n")
                self.send_response(status)
                pieces = [body] if isinstance(body, bytes) else body
                self.send_header("Connection", "close")
                if isinstance(body, bytes) and "Content-Length" not in headers:
                    self.send_header("Content-Length", str(len(body)))
                for name, value in headers.items():
                    if value is not None:
                        self.send_header(name, value)
                self.end_headers()
                for piece in pieces:
                    self.wfile.write(piece)
            self.close_connection = True

        def do_GET(self):
            path, _, query = self.path.partition("?")
            assert path.startswith("/web/"), path
            name = path.rsplit("/", 1)[1]
            answer = answers.get(name, truth.get(name, (404, b"", {})))
            if name in ("studies", "series", "instances") and answer is truth.get(name) and "offset=0" not in query:
                answer = (204, b"", {})
            self.answer(answer(query) if callable(answer) else answer)

        def do_POST(self):
            assert self.path == "/web/studies" and self.headers["Content-Type"].startswith(
                'multipart/related; type="application/dicom"; boundary='
            )
            body = self.rfile.read(int(self.headers["Content-Length"]))
            posts.append(body)
            answer = answers["POST"]
            self.answer(answer(len(posts)) if callable(answer) else answer)

        def log_message(self, *a):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Liar)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    there = f"http://127.0.0.1:{server.server_address[1]}/web"
    keys = ("--study", study, "--accession", "7", "--patient-id", "lied", "--modality", "CT")

    # The truth first; a terminal is not told what to do.
    assert "Red ?[31m" in web("fetch", *keys, at=there)
    assert (
        web("fetch", *keys, "-o", "true", "--json", "--quiet", at=there.replace("127.0.0.1", "localhost"))["images"]
        == 3
    )
    assert [p.read_bytes() for p in sorted((work / "true").iterdir())] == good
    # What is asked for comes as it was meant, whatever is in it.
    answers["studies"] = lambda query: (
        200,
        as_json(
            [
                of_study
                | {
                    "00100020": text(urllib.parse.parse_qs(query)["PatientID"][0], "LO"),
                    "00080050": text("a b&c=%41+/#", "SH"),
                }
            ]
        ),
        {},
    )
    assert "Red" in web("fetch", "--patient-id", "&Łódź;+ 1", "--accession", "A b&c=%41+/#", at=there)
    del answers["studies"]
    # Servers that give fewer than they are asked for, and one that knows no offset.
    answers["instances"] = lambda query: (
        200,
        as_json(of_instances[int(dict(p.split("=") for p in query.split("&"))["offset"]) :][:1]),
        {},
    )
    assert web("fetch", *keys, "-o", "paged", "--json", "--quiet", at=there)["images"] == 3
    answers["instances"] = lambda query: truth["instances"]
    assert web("fetch", *keys, "-o", "unpaged", "--json", "--quiet", at=there)["images"] == 3
    answers.clear()

    def endless(piece):
        while True:
            yield piece

    counter = iter(range(1, 10**9))
    new_ones = lambda attribute, others, page=500: lambda query: (
        200,
        as_json([others | {attribute: text(f"1.9.{next(counter)}")} for _ in range(page)]),
        {},
    )
    type_of = lambda value: {"Content-Type": value}
    M = type_of(MULTI)
    whole = multi(good)
    # Sequences within sequences: who reads them as a tree climbs until the stack ends.
    nested = instance(0)
    at = nested.index(b"\xe0\x7f\x10\x00")
    deep = nested[:at] + (b"\x40\x00\x30\xa7SQ\x00\x00\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff") * 1_000_000
    lies = [  # name, answer, exit codes, a word of what is said
        ("studies", (200, b"<html>", {}), 7, "no list"),
        ("studies", (200, b"{}", {}), 7, "no list"),
        ("studies", (200, b"", {}), 7, "no list"),
        ("studies", (200, b"[" * 100_000, {}), 7, "no list"),
        ("studies", (200, b" " * 20_000_000, {}), 7, "more than 8 MB"),
        ("studies", (200, endless(b"[" + b"{}," * 10_000), {}), 7, "more than 8 MB"),
        ("studies", (200, b"[" + b"{}," * 2_600_000 + b"{}]", {}), 7, "without a UID"),
        ("studies", (200, as_json([{}]), {}), 7, "without a UID"),
        ("studies", (200, as_json([1, "x", None]), {}), 7, "without a UID"),
        ("studies", (200, as_json([of_study | {"0020000D": text("../../../system")}]), {}), 7, "without a UID"),
        ("studies", (200, as_json([of_study | {"0020000D": text("1.2.840.2")}]), {}), 7, "not asked for"),
        ("studies", (200, as_json([of_study | {"00100020": text("ANOTHER", "LO")}]), {}), 7, "not asked for"),
        ("studies", (302, b"", {"Location": "/web/elsewhere"}), 7, "points elsewhere"),
        ("studies", (500, b"no", {}), 7, "status 500"),
        ("studies", (401, b"", {"WWW-Authenticate": "Basic"}), 7, "rejects the login"),
        ("studies", "stall", 7, "imeout"),
        ("studies", "hang up", 7, ""),
        ("studies", (200, b"", "endless"), 7, ""),
        ("studies", (200, b"[]", {"Content-Length": "100"}), 7, ""),
        ("studies", new_ones("0020000D", {}), 7, "not asked for"),
        ("series", new_ones("0020000E", of_series), 2, "more than 10000"),
        ("series", (200, as_json([of_series | {"00080060": text("MR", "CS")}]), {}), 7, "not asked for"),
        ("series", (200, as_json([of_series | {"0020000D": text("1.2.840.2")}]), {}), 7, "not asked for"),
        ("series", (200, as_json([of_series | {"0020000E": text("1.2/../..")}]), {}), 7, "without a UID"),
        ("series", (200, as_json([of_series | {"00201209": text(4, "IS")}]), {}), 7, "4 objects"),
        ("instances", (404, b"", {}), 7, "status 404"),
        ("instances", (200, as_json([{"00080018": text("x")}]), {}), 7, "without a UID"),
        ("instances", (204, b"", {}), 3, "nothing of this series"),
        ("instances", (200, as_json(of_instances[:2]), {}), 7, "2 are listed"),
        (series, (200, whole[:-40], M), 7, "broke off"),
        (series, (200, whole[:-2], M), 7, "broke off"),
        (series, (200, b"", M), 7, "broke off"),
        (series, (200, whole[:-100], M | {"Content-Length": str(len(whole))}), 7, ""),
        (series, (200, multi(good[:2]), M), 7, "2 came"),
        (series, (200, multi([*good, good[0]]), M), 7, "more objects"),
        (series, (200, multi([good[0], good[1], good[1]]), M), 7, "twice"),
        (series, (200, multi([]), M), 7, ""),
        (series, (200, whole, type_of(MULTI.replace("b 0", "b 1"))), 7, ""),
        (series, (200, whole, type_of(MULTI.split("; b")[0])), 7, "boundary"),
        (series, (200, whole, type_of(MULTI.replace("b 0", "b" * 71))), 7, "boundary"),
        (series, (200, whole, type_of("application/json")), 7, "no DICOM objects"),
        (series, (200, whole, {}), 7, "no DICOM objects"),
        (series, (200, whole, type_of(MULTI.replace("application/dicom", "image/jpeg"))), 7, "no DICOM objects"),
        (series, (200, whole, type_of(MULTI + "; boundary=x")), 7, ""),
        (series, (200, multi(good, b"Content-Type: text/html\r\n\r\n"), M), 7, "no DICOM object"),
        (series, (200, multi(good, b"X: " + b"x" * 100_000), M), 7, "head of a part"),
        (series, (200, multi([good[0], good[1], instance(2, cut=-9)]), M), 7, "no whole DICOM"),
        (series, (200, multi([good[0], good[1], b""]), M), 7, "no whole DICOM"),
        (series, (200, multi([good[0], good[1], b"x" * 5000]), M), 7, "no whole DICOM"),
        (series, (200, multi([good[0], good[1], instance(2, of="1.2.840.9")]), M), 7, "not asked for"),
        (series, (200, multi([good[0], good[1], instance(7)]), M), 7, "not asked for"),
        (series, (200, multi([deep, good[1], good[2]]), M), 7, ""),
        (series, (200, endless(b"x" * 65_536), M), 7, "boundary"),
        (
            series,
            (200, (p for head in [b"--b 0\r\n" + PART] for p in [head, *([b"x" * 65_536] * 100_000)]), M),
            9,
            "larger than allowed",
        ),
        (series, (302, b"", {"Location": f"/web/{series}"}), 7, "points elsewhere"),
        (series, (307, b"", {"Location": "http://127.0.0.1:1/"}), 7, "points elsewhere"),
        (series, (206, whole, M), 7, "status 206"),
        (series, (404, b"", {}), 7, "status 404"),
        (series, (406, b" " * 20_000_000, {}), 7, "status 406"),
        (series, (500, b"no", {}), 7, "status 500"),
        (series, (403, b"", {}), 7, "rejects the login"),
        (series, "stall", 7, "imeout"),
        (series, "hang up", 7, ""),
        (series, (200, iter([whole[:2000]]), M), 7, "broke off"),
    ]
    before = set(work.iterdir())
    peak = 0
    for n, (name, lie, rc, word) in enumerate(lies):
        answers.clear()
        answers[name] = lie
        line = [
            osteo,
            "fetch",
            *keys,
            "-o",
            work / f"lied-{n}",
            "--series-gb",
            "0.05",
            "--dicomweb",
            there,
            "--dicomweb-login",
            "login",
            "--timeout-s",
            "2" if lie == "stall" else "60",
        ]
        with open(work / "lied.txt", "w+") as log:
            process = subprocess.Popen([str(a) for a in line], stdout=log, stderr=log)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            log.seek(0)
            err = log.read()
        said.append(err)
        peak = max(peak, used.ru_maxrss)
        assert process.returncode == rc and word in err and "core" not in err, (
            n,
            name,
            str(lie)[:200],
            process.returncode,
            rc,
            err,
        )
        assert set(work.iterdir()) - {work / "lied.txt"} == before, (n, name, set(work.iterdir()) - before)
    print(f"{len(lies)} lies to fetch: at most {peak / 1000:.0f} MB")
    assert peak < 900_000, peak  # an answer of 8 MB in JSON becomes 450 MB
    # Stopped in the middle: nothing is left.
    answers.clear()
    asked = threading.Event()
    answers[series] = lambda query: asked.set() or "stall"
    with (
        open(work / "lied.txt", "w") as log,
        subprocess.Popen(
            [str(a) for a in [osteo, "fetch", *keys, "-o", work / "stopped", "--dicomweb", there]],
            stdout=log,
            stderr=log,
        ) as process,
    ):
        assert asked.wait(120)
        process.send_signal(signal.SIGINT)
        assert process.wait(120) == 130
    assert set(work.iterdir()) - {work / "lied.txt"} == before
    # STOW-RS: what it says of each object is believed in nothing but refusals, until the query finds it.
    (work / "out").mkdir()
    for n, data in enumerate(good):
        (work / "out" / f"{n}.dcm").write_bytes(data)
    stored = lambda *which, **more: [
        {"00081150": text("1.2"), "00081155": text(f"{series}.{n}"), **more} for n in which
    ]
    reason = lambda code: {"00081197": {"vr": "US", "Value": [code]}}
    response = lambda ok=(), bad=(): as_json(
        {k: {"vr": "SQ", "Value": list(v)} for k, v in (("00081199", ok), ("00081198", bad)) if v}
        | {"00081190": text("http://elsewhere", "UR")}
    )
    warned = {"00081196": {"vr": "US", "Value": [0xB000]}}
    for n, (answer, accepted, safe, word) in enumerate(
        [
            ((200, response(stored(0, 1, 2)), {}), 3, 3, ""),
            ((200, b"[" + response(stored(0, 1, 2)) + b"]", {}), 3, 3, ""),
            ((202, response(stored(0, 1, 2, **warned)), {}), 3, 3, "changed values"),
            ((202, response(stored(0, 2), stored(1, **reason(0xA700))), {}), 2, 2, "out of resources"),
            ((202, response(stored(0, 2), stored(1, **reason(0xC122))), {}), 2, 2, "transfer syntax"),
            ((200, response(stored(0, 1, 2), stored(1, **reason(0x0124))), {}), 2, 2, "may not send"),
            ((200, response(stored(0, 1, 7)), {}), 2, 2, "does not say"),
            ((409, response((), stored(0, 1, 2, **reason(0x0111))), {}), 0, 0, "another object"),
            ((409, response(stored(0, 1, 2)), {}), 0, 0, "does not say"),
            ((202, response((), stored(0, 1, 2)), {}), 0, 0, "does not say why"),
            ((200, b"", {}), 0, 0, "no JSON"),
            ((200, b"<NativeDicomModel/>", {}), 0, 0, "no JSON"),
            ((200, b"[" * 100_000, {}), 0, 0, "no JSON"),
            ((200, b"[1]", {}), 0, 0, "no JSON"),
            ((204, b"", {}), 0, 0, "status 204"),
            ((400, b"no", {}), 0, 0, "status 400"),
            ((413, b"no", {}), 0, 0, "too long"),
            ((415, b"no", {}), 0, 0, "status 415"),
            ((500, b"no" * 10_000_000, {}), 0, 0, "status 500"),
            ((503, b"no", {}), 0, 0, "out of resources"),
        ]
    ):
        answers.clear()
        answers["POST"] = answer
        posts.clear()
        result = web("send", "out", "--json", "--quiet", at=there, rc=0 if safe == 3 else 8)
        assert (result["objects"], result["accepted"], result["safe"]) == (3, accepted, safe), (n, answer, result)
        assert word in json.dumps(result["problems"]) and len(result["problems"]) >= 3 - safe, (n, result)
        assert len(posts) == 1 and all(posts[0].count(data) == 1 for data in good), "each as it is, once"
    # Accepted, and not there; a query that fails.
    answers |= {
        "POST": (200, response(stored(0, 1, 2)), {}),
        "instances": lambda query: (200, as_json(of_instances[:1]), {}),
    }
    result = web("send", "out", "--json", "--quiet", at=there, rc=8)
    assert (result["accepted"], result["safe"]) == (3, 1) and "does not find it" in json.dumps(result), result
    answers["instances"] = (500, b"", {})
    result = web("send", "out", "--json", at=there)
    assert (
        (result["accepted"], result["checked"]) == (3, False)
        and "not asked afterwards" in said[-1]
        and "status 500" in said[-1]
    ), said[-1]
    del answers["instances"]
    for answer in (
        (302, b"", {"Location": "/web/studies"}),
        (401, b"", {}),
        "stall",
        "hang up",
        (200, b" " * 20_000_000, {}),
        (200, b"", "endless"),
    ):
        answers["POST"] = answer
        web("send", "out", at=there, rc=7, timeout="2" if answer == "stall" else "60")
    # Lost on the way: what was sent before is told, and what was not.
    posts.clear()
    answers["POST"] = lambda n: (
        (
            200,
            as_json({"00081199": {"vr": "SQ", "Value": [{"00081155": text(f"1.2.3.50.{i}")} for i in range(130)]}}),
            {},
        )
        if n == 1
        else "hang up"
    )
    answers["instances"] = lambda query: (200, as_json([{"00080018": text(f"1.2.3.50.{i}")} for i in range(130)]), {})
    result = web("send", "many", "--json", "--quiet", at=there, rc=8)
    assert (result["objects"], result["accepted"], result["safe"], len(result["problems"])) == (
        130,
        100,
        100,
        30,
    ), result
    server.shutdown()
    # TLS: its certificate must be of those that are trusted, and for its name.
    run(
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "rsa:2048",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=127.0.0.1",
        "-keyout",
        "web.key",
        "-out",
        "web.pem",
        "-addext",
        "subjectAltName=IP:127.0.0.1",
    )
    secure = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Liar)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain("web.pem", "web.key")
    secure.socket = context.wrap_socket(secure.socket, server_side=True)
    threading.Thread(target=secure.serve_forever, daemon=True).start()
    there = f"https://127.0.0.1:{secure.server_address[1]}/web"
    answers.clear()
    assert "images" in web("fetch", *keys, "--dicomweb-ca", "web.pem", at=there)
    assert "ertificate" in web("fetch", *keys, at=there, rc=7)
    assert "ertificate" in web(
        "fetch", *keys, "--dicomweb-ca", "web.pem", at=there.replace("127.0.0.1", "localhost"), rc=7
    )
    web("fetch", *keys, "--dicomweb-ca", "nowhere.pem", at=there, rc=3)
    secure.shutdown()
    assert not any("tell-nobody" in text for text in said), "told"


def ct_series_of(ask, uid):
    return next(i for i in ask("/series") if ask(f"/series/{i}")["MainDicomTags"]["SeriesInstanceUID"] == uid)


def ask_bytes(port, login, instance):
    """The data set of an object, as the server has it."""
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}/instances/{instance}/file",
        headers={"Authorization": "Basic " + base64.b64encode(login.encode()).decode()},
    )
    (work / "theirs.dcm").write_bytes(urllib.request.urlopen(request, timeout=60).read())
    return data_set(work / "theirs.dcm")


def tls():
    files = make_scan()
    for name, issuer in (("ca", None), ("ours", "ca"), ("node", "ca"), ("other-ca", None), ("stranger", "other-ca")):
        signed = ["-CA", f"{issuer}.pem", "-CAkey", f"{issuer}.key"] if issuer else []
        run(
            "openssl",
            "req",
            "-x509",
            "-newkey",
            "rsa:2048",
            "-nodes",
            "-days",
            "2",
            "-subj",
            f"/CN={name}",
            "-keyout",
            f"{name}.key",
            "-out",
            f"{name}.pem",
            "-addext",
            "basicConstraints=critical,CA:" + ("FALSE" if issuer else "TRUE"),
            *signed,
        )
    with_tls = lambda name, ca="ca": [
        "--tls-ca",
        f"{ca}.pem",
        "--tls-certificate",
        f"{name}.pem",
        "--tls-key",
        f"{name}.key",
    ]
    for flags in (
        ["--tls-ca", "ca.pem"],
        ["--tls-ca", "ca.pem", "--tls-certificate", "node.pem"],
        ["--tls-certificate", "node.pem", "--tls-key", "node.key"],
    ):
        run(osteo, "receive", "x", "--allow-all", "--port", "0", *flags, rc=2)
    run(
        osteo,
        "receive",
        "x",
        "--allow-all",
        "--port",
        "0",
        "--tls-ca",
        "nowhere.pem",
        "--tls-certificate",
        "node.pem",
        "--tls-key",
        "node.key",
        rc=3,
    )
    for pair in (("node.pem", "ours.key"), ("node.key", "node.key"), ("node.pem", files[0])):
        run(
            osteo,
            "receive",
            "x",
            "--allow-all",
            "--port",
            "0",
            "--tls-ca",
            "ca.pem",
            "--tls-certificate",
            pair[0],
            "--tls-key",
            pair[1],
            rc=5,
        )
    # A key that others may read is told, and only that.
    for mode, told in ((0o644, True), (0o640, True), (0o600, False)):
        os.chmod("node.key", mode)
        node = Receiver("inbox", "--allow", "PEER", "--quiet-s", "1", "--timeout-s", "5", *with_tls("node"))
        assert ("others may read the key 'node.key'" in (work / "inbox.log").read_text()) == told, (
            oct(mode),
            (work / "inbox.log").read_text(),
        )
        if told:
            node.stop()
    send = lambda *flags, rc=0: run(
        osteo,
        "send",
        "ct",
        "--peer",
        f"OSTEOTOME@127.0.0.1:{node.port}",
        "--ae",
        "PEER",
        "--no-check",
        "--timeout-s",
        "5",
        "--quiet",
        *flags,
        rc=rc,
    )
    # Nobody without a certificate of ours, and none from elsewhere; nor do we speak to a node that has another.
    send(rc=7)
    send("--tls-ca", "ca.pem", rc=7)
    send(*with_tls("stranger"), rc=7)
    send(*with_tls("ours", "other-ca"), rc=7)
    # Nor TLS of old, nor one who says nothing.
    old = subprocess.run(
        [
            "openssl",
            "s_client",
            "-connect",
            f"127.0.0.1:{node.port}",
            "-tls1_1",
            "-cert",
            "ours.pem",
            "-key",
            "ours.key",
        ],
        capture_output=True,
        input=b"",
    )
    assert b"Cipher is (NONE)" in old.stdout, old.stdout
    silent = socket.create_connection(("127.0.0.1", node.port))
    assert node.objects() == []
    begin = time.monotonic()
    os.chmod("ours.key", 0o604)
    loud = run(
        osteo,
        "send",
        "ct",
        "--peer",
        f"OSTEOTOME@127.0.0.1:{node.port}",
        "--ae",
        "PEER",
        "--no-check",
        *with_tls("ours"),
    )
    assert "others may read the key 'ours.key'" in loud.stderr, loud.stderr
    os.chmod("ours.key", 0o600)
    print(f"send over TLS: {len(files)} slices in {time.monotonic() - begin:.2f} s")
    assert sorted(map(data_set, node.objects())) == sorted(map(data_set, files)), "bit for bit"
    assert node.closed()["objects"] == len(files)
    silent.settimeout(60)
    assert silent.recv(1) == b"", "it is hung up on"
    # Programs of others: DCMTK's, with TLS.
    said = subprocess.run(
        [
            "storescu",
            "-aet",
            "PEER",
            "-aec",
            "OSTEOTOME",
            "+tls",
            "ours.key",
            "ours.pem",
            "+cf",
            "ca.pem",
            "127.0.0.1",
            str(node.port),
            str(files[0]),
        ],
        capture_output=True,
        text=True,
    )
    assert said.returncode == 0, said.stderr
    node.stop()


def units():
    if not shutil.which("systemd-analyze"):
        print("skipped: systemd-analyze not installed (Debian: systemd)")
        sys.exit(77)
    share = pathlib.Path(__file__).resolve().parents[2] / "apps" / "share"
    text = {}
    for name in ("osteo-receive.service", "osteo-watch.service", "osteo-watch-orthanc@.service"):
        text[name] = (share / name).read_text()
        assert "/usr/bin/osteo " in text[name]
        unit = work / name.replace("@", "@main")
        unit.write_text(text[name].replace("/usr/bin/osteo", str(osteo)))
        r = run("systemd-analyze", "verify", "--man=no", unit)
        assert r.stderr == "", r.stderr
        # What it calls is there.
        called = next(line for line in text[name].splitlines() if line.startswith("ExecStart=")).split()
        known = run(osteo, called[1], "--help").stdout
        assert all(flag in known for flag in called if flag.startswith("--")), called
    # The worker of an Orthanc may do what the other may, and reach the network.
    bounds = [
        {
            l
            for l in text[n].split("[Service]")[1].splitlines()
            if l
            and l[0] != "#"
            and l.split("=")[0] not in ("Environment", "EnvironmentFile", "ExecStart", "StateDirectory")
        }
        for n in ("osteo-watch.service", "osteo-watch-orthanc@.service")
    ]
    assert bounds[0] - bounds[1] == {"PrivateNetwork=yes", "RestrictAddressFamilies=AF_UNIX"}, bounds[0] - bounds[1]
    assert bounds[1] - bounds[0] == {"RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6"}, bounds[1] - bounds[0]

    # Its line, as systemd makes it of the file that the unit tells of, asks that server with that login.
    asked = []

    class Server(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            asked.append((self.path, self.headers.get("Authorization")))
            body = json.dumps({"Changes": [], "Done": True, "Last": 0}).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    unit = text["osteo-watch-orthanc@.service"]
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Server) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        told = [l[1:].strip() for l in unit.splitlines() if re.match(r"#   OSTEO_", l)]  # the example of its head
        assert [l.split("=")[0] for l in told] == [
            "OSTEO_ORTHANC",
            "OSTEO_ORTHANC_LOGIN",
            "OSTEO_RULES",
            "OSTEO_WATCH_FLAGS",
        ], told
        settings = dict(shlex.split(l)[0].split("=", 1) for l in told[:2])
        settings |= {
            "OSTEO_ORTHANC": f"http://127.0.0.1:{server.server_port}",
            "OSTEO_WATCH_FLAGS": "--once --jobs 2",
            "OSTEO_RULES": str(share.parents[1] / "pipelines" / "rules.json"),
        }
        state = work / "state"
        for folder in next(l for l in unit.splitlines() if l.startswith("StateDirectory=")).split("=")[1].split():
            (state / folder.replace("osteo/", "").replace("osteo", "").replace("%i", "main")).mkdir(
                mode=0o700, parents=True, exist_ok=True
            )
        line = next(l for l in unit.splitlines() if l.startswith("ExecStart=")).split("=", 1)[1]
        words = []
        for word in (
            line.replace("/usr/bin/osteo", str(osteo))
            .replace("/var/lib/osteo", str(state))
            .replace("%i", "main")
            .split()
        ):
            words += (
                settings[word[1:]].split()
                if re.fullmatch(r"\$\w+", word)
                else [re.sub(r"\$\{(\w+)\}", lambda m: settings[m[1]], word)]
            )
        r = subprocess.run(words, env=os.environ | settings, capture_output=True, text=True, timeout=120)
        server.shutdown()
    assert r.returncode == 0, r.stderr
    login = "Basic " + base64.b64encode(b"USER:PASSWORD").decode()
    assert any(path.startswith("/changes") and given == login for path, given in asked), asked
    assert (
        (state / "main-spool" / ".orthanc.json").is_file()
        and (state / "main-watch.prom").is_file()
        and (state / "main-cases").is_dir()
    )


{
    "orthanc": round_trip,
    "hostile": hostile,
    "watch": watch,
    "doors": doors,
    "dicomweb": dicomweb,
    "dicomweb_lies": dicomweb_lies,
    "tls": tls,
    "units": units,
}[part]()
print(f"pacs {part}: all as it should be")
