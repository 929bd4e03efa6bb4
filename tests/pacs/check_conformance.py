"""The conformance statement against what is negotiated: pynetdicom proposes and answers, the page says what must come.
usage: check_conformance.py BIN WORK PAGE      exits 77 (skipped) when pynetdicom is missing"""

import json, pathlib, re, shutil, subprocess, sys

try:
    import pydicom
    from pydicom.dataset import Dataset
    from pynetdicom import AE, build_context, evt
    from pynetdicom.sop_class import StudyRootQueryRetrieveInformationModelFind as FIND
    from pynetdicom.sop_class import StudyRootQueryRetrieveInformationModelGet as GET
    from pynetdicom.sop_class import StudyRootQueryRetrieveInformationModelMove as MOVE
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)
osteo, work = pathlib.Path(sys.argv[1]).resolve() / "osteo", pathlib.Path(sys.argv[2]).resolve()
page = pathlib.Path(sys.argv[3]).read_text()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def rows(head):
    """UIDs of the table whose first column has this head, in its order."""
    (begin,) = [m.end() for m in re.finditer(rf"^\| {head} \| UID \|.*\n\|[-|]+\n", page, re.M)]
    lines = page[begin:].split("\n\n")[0].splitlines()
    return [line.split("|")[2].strip() for line in lines]


def section(title):
    return page[page.index(f"## {title}") :].split("\n## ")[0]


classes, forms = rows("storage class"), rows("transfer syntax, in order of preference")
assert len(classes) > 180 and len(forms) == 13 and "1.2.840.10008.5.1.4.1.1.66.7" in classes
page_of_fetch = section("What is fetched by C-GET")
images, image_forms, objects = (
    [line.split("|")[2].strip() for line in t.splitlines()[2:]]
    for t in re.findall(r"(?:^\|.*\n)+", page_of_fetch, re.M)
)

# The storage node: each class in each form, alone and among others, and nothing else.
node = subprocess.Popen(
    [osteo, "receive", work / "inbox", "--port", "0", "--json", "--keep-free-gb", "0", "--allow", "TESTER"],
    stdout=subprocess.PIPE,
    stderr=open(work / "node.log", "w"),
    text=True,
)
port = json.loads(node.stdout.readline())["listening"]


def negotiate(contexts):
    """Abstract and transfer syntax of what the node accepts, of these contexts."""
    ae = AE("TESTER")
    ae.requested_contexts = contexts
    association = ae.associate("127.0.0.1", port, ae_title="OSTEOTOME")
    assert not association.is_rejected, association
    accepted = [(c.abstract_syntax, c.transfer_syntax[0]) for c in association.accepted_contexts]
    if association.is_established:
        association.release()
    return accepted


try:
    pairs = [(c, f) for c in classes for f in forms]
    got = []
    for n in range(0, len(pairs), 128):
        got += negotiate([build_context(c, f) for c, f in pairs[n : n + 128]])
    assert sorted((str(c), str(f)) for c, f in got) == sorted(pairs), len(got)
    print(f"ok  the node accepts {len(got)} pairs of class and form: all of the page")
    # Of several forms the first of the page's order, whatever the sender's order.
    for several in (forms, forms[::-1], forms[4:][::-1], ["1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2"]):
        ((_, chosen),) = negotiate([build_context(classes[0], several)])
        assert chosen == next(f for f in forms if f in several), (several, chosen)
    others = ["1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2.4.110", "1.2.840.10008.1.2.8.1", "1.2.840.10008.1.2.1.98"]
    assert not set(others) & set(forms)
    refused = [build_context("1.2.840.10008.5.1.4.1.1.2", f) for f in others]
    refused += [build_context(c) for c in (FIND, MOVE, GET, "1.2.840.10008.1.20.1", "1.2.840.10008.5.1.4.1.1.99.1")]
    echo = build_context("1.2.840.10008.1.1")
    assert [str(a) for a, _ in negotiate([echo, *refused])] == ["1.2.840.10008.1.1"]
    print(f"ok  the node accepts none of {len(refused)} that the page does not name")
    # A label map goes in as it is.
    run = lambda *a: subprocess.run([osteo, *a, "--quiet"], cwd=work, check=True, capture_output=True)
    run("phantom", "ct.nrrd", "--region", "temporal", "--spacing-mm", "3")
    run("threshold", "ct.nrrd", "mask.nrrd", "--lower", "500")
    run("convert", "mask.nrrd", "map.dcm", "--segmentation", "labelmap")
    d = pydicom.dcmread(work / "map.dcm")
    ae = AE("TESTER")
    ae.add_requested_context(d.SOPClassUID, d.file_meta.TransferSyntaxUID)
    association = ae.associate("127.0.0.1", port, ae_title="OSTEOTOME")
    assert association.send_c_store(d).Status == 0
    association.release()
    (stored,) = (work / "inbox").rglob("*.dcm")
    assert pydicom.dcmread(stored).PixelData == d.PixelData
    r = subprocess.run(
        [osteo, "send", work / "map.dcm", "--dry-run", "--json", "--peer", f"X@127.0.0.1:{port}"],
        capture_output=True,
        text=True,
    )
    assert json.loads(r.stdout)["kinds"][0]["kind"] == "Label Map Segmentation Storage", r.stdout + r.stderr
    print("ok  a label map by C-STORE, its class by name")
finally:
    node.terminate()
    node.wait(60)

# fetch: what it proposes to a node, with which roles.
proposed = []


def requested(event):
    primitive = event.assoc.requestor.primitive
    roles = {i.sop_class_uid: i for i in event.assoc.requestor.role_selection.values()}
    contexts = primitive.presentation_context_definition_list
    proposed.append(([(str(c.abstract_syntax), [str(t) for t in c.transfer_syntax]) for c in contexts], roles))


def find(event):
    answer = Dataset()
    answer.QueryRetrieveLevel = event.identifier.QueryRetrieveLevel
    answer.StudyInstanceUID, answer.StudyDate = "1.2.3", "20260101"
    if answer.QueryRetrieveLevel == "SERIES":
        answer.SeriesInstanceUID, answer.Modality, answer.SeriesNumber = "1.2.3.4", "CT", 1
        answer.SeriesDescription, answer.NumberOfSeriesRelatedInstances = "x", 1
    yield 0xFF00, answer


def get(event):
    yield 0


ae = AE("PEER")
ae.add_supported_context(FIND)
ae.add_supported_context(GET)
for c in images + objects:
    ae.add_supported_context(c, image_forms, scu_role=True, scp_role=True)
server = ae.start_server(
    ("127.0.0.1", 0),
    block=False,
    evt_handlers=[(evt.EVT_REQUESTED, requested), (evt.EVT_C_FIND, find), (evt.EVT_C_GET, get)],
)
try:
    r = subprocess.run(
        [osteo, "fetch", "--peer", f"PEER@127.0.0.1:{server.server_address[1]}", "--study", "1.2.3", "-o", "out"],
        cwd=work,
        capture_output=True,
        text=True,
    )
    assert r.returncode == 3 and "has nothing of this series" in r.stderr, (r.returncode, r.stderr)
finally:
    server.shutdown()
plain = ["1.2.840.10008.1.2.1", "1.2.840.10008.1.2"]
assert proposed[0][0] == [(str(FIND), plain)], proposed[0]
(contexts, roles) = proposed[-1]
wanted = [(str(GET), plain)]
wanted += [(c, [f]) for c in images for f in image_forms] + [(c, [f]) for c in objects for f in image_forms[:3]]
assert sorted(contexts) == sorted(wanted), (len(contexts), len(wanted))
assert {str(u) for u, r in roles.items() if r.scp_role} == set(images + objects)
print(f"ok  fetch proposes {len(contexts)} contexts by C-GET and plays SCP for {len(roles)} classes: those of the page")
