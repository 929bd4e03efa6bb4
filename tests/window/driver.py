"""What the window drivers have in common: a screen of their own, a program that says what it shows, waiting for it, keys."""

import json, os, pathlib, subprocess, time

os.environ["LANGUAGE"] = "en"  # what is compared is English, wherever it runs
PATIENCE_S = 240  # of a wait; on a machine at rest most take a second


def wait(what, condition):
    end = time.monotonic() + PATIENCE_S
    while True:
        found = condition()
        if found:
            return found
        assert time.monotonic() < end, f"waited in vain: {what}"
        time.sleep(0.03)


def x(*args):
    """xdotool; what it prints."""
    return subprocess.run(["xdotool", *map(str, args)], capture_output=True, text=True).stdout


class Screen:
    """Xvfb of WIDTHxHEIGHT pixels, which is DISPLAY as long as it is there."""

    def __init__(self, size="1000x700"):
        self.size = size

    def __enter__(self):
        read, write = os.pipe()
        command = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{self.size}x24", "-nolisten", "tcp"]
        self.server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as f:
            os.environ["DISPLAY"] = ":" + f.readline().strip()
        return self

    def __exit__(self, *_):
        self.server.kill()
        self.server.wait()


class Program:
    """Runs in the folder where the driver is, which then has its state and what it said. `title`: how its window's begins."""

    x = staticmethod(x)

    def __init__(self, command, title, before=None):
        self.file = pathlib.Path(f"state-{time.monotonic_ns()}.json")
        self.log = open(f"{self.file}.log", "w+")
        self.app = subprocess.Popen(
            [*map(str, command), "--state-file", str(self.file)], stderr=self.log, preexec_fn=before
        )
        wait("the window's first picture", lambda: self.file.exists() or self.app.poll() is not None)
        assert self.app.poll() is None, (self.app.returncode, self.said())
        self.id = wait("the window", lambda: x("search", "--name", f"^{title}").split())[-1]

    def said(self):
        self.log.flush()
        return pathlib.Path(self.log.name).read_text()

    def state(self):
        return json.loads(self.file.read_text())

    def until(self, what, condition):
        """The state that meets it."""
        last = {}

        def look():
            nonlocal last
            assert self.app.poll() is None, (what, self.app.returncode, self.said())
            last = self.state()
            return condition(last) and last

        try:
            return wait(what, look)
        except AssertionError as e:
            raise AssertionError(f"{e}; {last}; {self.said()}") from None

    def key(self, key, what, condition):
        x("key", key)
        return self.until(f"{key}: {what}", condition)

    def item(self, words, what, condition):
        """Clicks what has these words, once it stays where it is."""
        last = None

        def still(state):
            nonlocal last
            at, picture = state["items"].get(words), state["pictures"]
            if last is not None and picture == last[1]:
                return False  # the same picture says nothing new
            before, last = last, (at, picture)
            return at is not None and before is not None and at == before[0]

        at = self.until(f"'{words}' is there", still)["items"][words]
        x("mousemove", *map(round, at))
        n = self.state()["pictures"]
        self.until("the mouse is seen there", lambda s: s["pictures"] > n + 1)
        x("click", 1)
        return self.until(f"'{words}': {what}", condition)

    def end(self, code=0):
        self.app.wait(PATIENCE_S)
        assert self.app.returncode == code, (self.app.returncode, self.said())
        return self.said()
