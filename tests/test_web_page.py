"""The web page as a visitor sees it, in a real browser: it walks, and its numbers are the package's."""

from __future__ import annotations

import csv
import functools
import hashlib
import http.server
import io
import re
import threading
from pathlib import Path

import numpy as np
import pytest

from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.vehicles import Skateboard, benchmark_bicycle, paper_bicycle, parameters_2005
from lean_yaw_env.viewer import PAGE, PageServer
from tests.browser import PATIENCE, chromium

WEB = Path(__file__).parents[1] / "web"
COARSE = "quality=4"  # fewer pixels: pictures are made in software here
# The page shows doubles; its root finder and eigenvalue solver are its own, and both are good to round-off.
SAME = 1e-9


@pytest.fixture(scope="module")
def browser():
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def address():
    with PageServer() as server:
        yield server.address


class Visit:
    """A page that has been opened, with what it complained of and asked for."""

    def __init__(self, browser, address, **context):
        self.context = browser.new_context(
            **{"viewport": {"width": 1280, "height": 800}, **context}
        )
        self.context.set_default_timeout(PATIENCE)
        self.page = self.context.new_page()
        self.complaints, self.requests = [], []
        self.page.on(
            "console", lambda m: m.type in ("error", "warning") and self.complaints.append(m.text)
        )
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(address)
        self.page.wait_for_selector("html[data-ready=true]")

    def look(self, expression):
        """The value of an expression about the page's own objects."""
        return self.page.evaluate(expression)

    def press(self, key, times=1):
        self.page.locator("#stage").focus()
        for _ in range(times):
            self.page.keyboard.press(key)

    def set_slider(self, name, value):
        """Move a slider as a hand does: to the nearest of its marks. Returns where it stands."""
        slider = self.page.locator(f"#{name}")
        slider.evaluate(
            "(input, value) => { input.value = value; input.dispatchEvent(new Event('input')); }",
            value,
        )
        return float(slider.input_value())

    def multipliers(self):
        rows = self.page.locator(".modes tbody tr[data-re]").all()
        return np.array(
            [
                complex(float(r.get_attribute("data-re")), float(r.get_attribute("data-im")))
                for r in rows
            ]
        )

    def close(self):
        self.context.close()


@pytest.fixture
def visit(browser, address):
    visits = []

    def open_page(settings="", **context):
        visits.append(Visit(browser, f"{address}#{COARSE}&{settings}", **context))
        return visits[-1]

    yield open_page
    for each in visits:
        each.close()


def assert_same_multipliers(ours, theirs):
    """The same set, in whatever order those of the same size come."""
    assert len(ours) == len(theirs)
    rest = list(theirs)
    for value in ours:
        nearest = min(rest, key=lambda other: abs(other - value))
        assert abs(nearest - value) < SAME
        rest.remove(nearest)


def test_built_page_is_from_the_sources_as_they_are():
    names = [p.relative_to(WEB).as_posix() for p in (WEB / "src").rglob("*") if p.is_file()]
    digest = hashlib.sha256()
    for name in sorted([*names, "index.html", "package-lock.json"]):
        digest.update(name.encode() + b"\0" + (WEB / name).read_bytes())
    kept = re.search(r'name="sources" content="(\w+)"', (PAGE / "index.html").read_text())
    assert kept and kept[1] == digest.hexdigest(), "the page has changed: run npm run build in web"


def test_page_loads_without_complaint_and_asks_for_its_own_files_only(visit, address):
    page = visit()
    page.page.wait_for_function("leanYaw.frames.summary().frames > 3")
    assert page.complaints == []
    assert all(url.startswith(address) for url in page.requests)


def test_stage_shows_a_picture_that_changes_while_it_walks(visit):
    page = visit()
    page.page.wait_for_function("leanYaw.frames.summary().frames > 2")
    stage = page.page.locator("#stage")
    script = """async () => {
        const picture = document.createElement('canvas');
        const { renderer, scene, camera } = leanYaw.stage;
        [picture.width, picture.height] = [160, 120];
        const pen = picture.getContext('2d');
        renderer.render(scene, camera);
        pen.drawImage(renderer.domElement, 0, 0, 160, 120);
        return Array.from(pen.getImageData(0, 0, 160, 120).data);
    }"""
    first = np.array(stage.evaluate(script), dtype=int)
    page.press(".", 3)
    second = np.array(stage.evaluate(script), dtype=int)
    colours = len(np.unique(first.reshape(-1, 4), axis=0))
    assert colours > 100  # a blank canvas has one
    assert np.abs(first - second).max() > 60
    assert page.complaints == []


def test_walk_on_the_page_is_the_packages_walk_bit_for_bit(visit):
    page = visit()
    page.press("p")
    page.press("r")
    page.press(".", 12)
    page.page.locator("summary", has_text="Take it with you").click()
    with page.page.expect_download() as download:
        page.page.locator("#share-csv").click()
    rows = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    names = ("heading", "stance_pitch", "ankle_angle", "stance_pitch_rate", "ankle_rate")
    states = np.array([[float(row[name]) for name in names] for row in rows])
    walk = Walker().walk(len(rows), state=states[0], stance=rows[0]["stance"])
    assert np.array_equal(states, walk.states[:-1])
    assert [row["stance"] for row in rows] == list(walk.stances[:-1])
    assert np.array_equal([float(row["duration"]) for row in rows], walk.durations)
    assert [float(row["impact_loss"]) for row in rows] == [e.impact_loss for e in walk.energies]


@pytest.mark.parametrize(
    "changes",
    [
        {"hip_width": 0.2},
        {"ankle_tilt": 1.2, "slope": 0.02},
        {"foot_radius": 0.6, "inter_leg_angle": 0.25},
        {"mass_offset": 0.003},
        {"ankle_stiffness": 0.1, "ankle_damping": 0.05},
    ],
    ids=lambda changes: "+".join(changes),
)
def test_sliders_show_the_packages_multipliers(visit, changes):
    page = visit()
    set_to = {name: page.set_slider(f"steered-{name}", value) for name, value in changes.items()}
    command = {k: set_to.pop(k) for k in ("inter_leg_angle", "mass_offset") if k in set_to}
    expected = find_limit_cycle(Walker(WalkerParameters(**set_to)), **command)
    page.page.wait_for_function(
        "speed => Math.abs(leanYaw.active().cycle?.speed - speed) < 1e-9", arg=expected.speed
    )
    assert_same_multipliers(page.multipliers(), expected.eigenvalues)
    shown = page.look(
        "({ state: leanYaw.active().cycle.state, step: leanYaw.active().cycle.stepLength })"
    )
    assert np.abs(np.array(shown["state"]) - expected.state).max() < SAME
    assert abs(shown["step"] - expected.step_length) < SAME
    verdict = "stable" if expected.is_stable else "unstable"
    assert page.page.locator("#verdict").get_attribute("data-state") == verdict


@pytest.mark.parametrize(
    ("tab", "parameters", "planar"),
    [
        ("plane", {"foot_radius": 0.0, "slope": 0.009}, True),
        ("plane", {"foot_radius": 0.5, "slope": 0.004}, True),
        ("space", {"foot_radius": 0.5, "slope": 0.00058, "ankle_tilt": 0.15}, False),
    ],
)
def test_passive_walkers_have_the_packages_multipliers(visit, tab, parameters, planar):
    settings = "&".join(f"{name}={value}" for name, value in parameters.items())
    page = visit(f"tab={tab}&{settings}")
    expected = find_limit_cycle(
        PassiveWalker(WalkerParameters(hip_width=0.0, **parameters), planar=planar)
    )
    page.page.wait_for_selector(".modes tbody tr[data-re]")
    assert_same_multipliers(page.multipliers(), expected.eigenvalues)
    assert abs(page.look("leanYaw.active().cycle.stridePeriod") - expected.stride_period) < SAME


@pytest.mark.parametrize("speed", [0.0, 2.5, 5.2, 8.0])
def test_bicycle_has_the_packages_eigenvalues(visit, speed):
    page = visit(f"tab=bicycle&speed={speed}")
    from lean_yaw_env.vehicles import benchmark_bicycle

    bicycle = benchmark_bicycle(parameters_2005())
    assert_same_multipliers(page.multipliers(), bicycle.eigenvalues(speed)[0])
    low, high = bicycle.stable_speed_range()
    shown = page.look("leanYaw.active().limits.map(limit => limit.speed)")
    assert np.abs(np.array(shown) - [low, high]).max() < SAME
    assert abs(paper_bicycle().weave_speed() - low) < 1e-3  # as the paper prints it, to five digits


def test_benchmark_bicycle_and_skateboard_have_the_packages_eigenvalues(visit):
    page = visit("tab=bicycle")
    page.page.get_by_role("button", name="Benchmark of 2007").click()
    assert_same_multipliers(page.multipliers(), benchmark_bicycle().eigenvalues(5.2)[0])
    page.page.locator("#tab-skateboard").click()
    board = Skateboard(damping=25.0)
    assert_same_multipliers(page.multipliers(), board.eigenvalues(1.4)[0])
    assert page.page.locator(".facts").first.inner_text().find(f"{board.critical_speed():.3f}") >= 0


def test_arrow_keys_steer_and_change_the_stride(visit):
    page = visit()
    page.press("p")
    page.press("r")
    page.page.locator("#stage").focus()
    page.page.keyboard.down("ArrowRight")
    page.press(".", 8)
    page.page.keyboard.up("ArrowRight")
    assert page.look("leanYaw.active().walk.state[0]") < -0.1  # to the right is negative
    offsets = page.look("leanYaw.active().walk.records.map(record => record.commandedOffset)")
    assert max(offsets) == 0.045
    page.press("ArrowUp")
    assert page.look("leanYaw.active().parameters.inter_leg_angle") == pytest.approx(0.32)
    assert page.page.locator("#steered-inter_leg_angle").input_value() == "0.32"


def test_pushes_make_it_fall_the_fall_is_named_and_r_starts_again(visit):
    page = visit()
    page.press("p")
    page.press("r")
    page.press(" ", 6)
    page.press(".", 10)
    notice = page.page.locator("#fall")
    notice.wait_for()
    assert notice.inner_text().startswith("It fell: ")
    fall = page.look("leanYaw.active().walk.current.fall.name")
    assert fall in notice.inner_text()
    page.press("r")
    assert notice.count() == 0
    page.press(".", 10)
    assert notice.count() == 0
    assert page.look("leanYaw.active().walk.records.length") == 10


def test_three_clicks_of_the_tour_lead_to_a_fall(visit):
    page = visit()
    page.press("p")
    page.page.locator("#why").click()
    for _ in range(3):
        page.page.locator("#lesson-next").click()
    page.press("p")
    for _ in range(60):
        page.press(".")
        if page.look("leanYaw.active().walk.hasFallen"):
            break
    page.page.locator("#fall").wait_for()
    page.page.wait_for_selector("#verdict[data-state=none]")
    page.page.locator("#lesson-next").click()
    assert page.look("leanYaw.active().parameters.ankle_tilt") == 0.55


def test_link_restores_every_slider_and_the_units(visit, address):
    page = visit()
    wanted = {"hip_width": 0.25, "slope": 0.012, "inter_leg_angle": 0.35, "mass_offset": 0.002}
    for name, value in wanted.items():
        page.set_slider(f"steered-{name}", value)
    page.page.locator("#units-system").select_option("moon")
    page.page.locator("#units-leg").fill("0.8")
    page.page.wait_for_function("location.hash.includes('leg=0.8')")
    link = page.page.url.split("#", 1)[1]
    other = visit(link)
    for name, value in wanted.items():
        assert float(other.page.locator(f"#steered-{name}").input_value()) == value
    assert other.page.locator("#units-system").input_value() == "moon"
    assert other.look("[leanYaw.units.si, leanYaw.units.leg, leanYaw.units.gravity]") == [
        True,
        0.8,
        1.62,
    ]
    assert "m/s" in other.page.locator(".facts").first.inner_text()


def test_narrow_screen_has_no_sideways_scroll_and_steers_by_touch(visit):
    page = visit(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    assert page.look("document.documentElement.scrollWidth") <= 390
    for name in ("#play", "#push", "#reset", "#touch-left", "#touch-right"):
        box = page.page.locator(name).bounding_box()
        assert box and box["x"] >= 0 and box["x"] + box["width"] <= 390
    page.page.locator("#play").tap()
    page.page.locator("#touch-right").tap()
    page.page.locator("#step").tap()
    page.page.locator("#step").tap()
    offsets = page.look("leanYaw.active().walk.records.map(record => record.commandedOffset)")
    assert 0.045 in offsets or page.look("leanYaw.active().walk.current.commandedOffset") == 0.045


def test_page_works_from_a_sub_path_of_any_static_host(browser, tmp_path):
    (tmp_path / "some").mkdir()
    (tmp_path / "some" / "where").symlink_to(PAGE)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    handler.func.log_message = lambda *_: None
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    visit = Visit(browser, f"http://127.0.0.1:{server.server_port}/some/where/#{COARSE}")
    visit.page.wait_for_function("leanYaw.frames.summary().frames > 1")
    assert visit.complaints == []
    visit.close()
    server.shutdown()


def test_basin_fills_in_and_the_gait_lies_in_it(visit):
    page = visit()
    page.page.get_by_role("button", name="Fill in").click()
    page.page.wait_for_function(
        "leanYaw.active().basin.count > 1000 && [32 * 64 + 32, 31 * 64 + 31].every((k) => leanYaw.active().basin.cells[k] >= 0)"
    )
    endings = page.look("Array.from(leanYaw.active().basin.cells)")
    middle = [endings[32 * 64 + 32], endings[31 * 64 + 31]]
    assert middle == [0, 0]
    assert len(set(endings)) >= 3  # walks on, and falls of several kinds


def test_gif_has_the_frames_asked_for(visit):
    page = visit()
    data = page.look(
        """async () => {
            const { stage, active } = leanYaw;
            const film = await leanYaw.makeGif(stage.canvas, 0.2, (duration) => {
                active().frame(duration, duration);
                stage.render();
            }, () => {});
            return Array.from(new Uint8Array(await film.arrayBuffer()));
        }"""
    )
    image = pytest.importorskip("PIL.Image")
    with image.open(io.BytesIO(bytes(data))) as film:
        assert (film.format, film.n_frames) == ("GIF", 4)


def test_frame_times_are_measured_in_the_page(visit, capsys):
    """Printed, not judged: they are the machine's, and here they are made in software."""
    page = visit()
    page.page.wait_for_function("leanYaw.frames.summary().frames > 30")
    one = page.look("leanYaw.frames.summary()")
    page.look("leanYaw.active().setCompany(8); leanYaw.frames.clear()")
    page.page.wait_for_function("leanYaw.frames.summary().frames > 60")
    eight = page.look("leanYaw.frames.summary()")
    with capsys.disabled():
        for name, times in (("one walker", one), ("eight", eight)):
            print(
                f"\n{name}: {times['work']:.2f} ms of script a frame, {times['between']:.0f} ms between frames"
            )
    assert one["frames"] > 0 and eight["work"] > 0.0


def test_saved_walk_is_walked_on_the_page_with_the_same_bits(browser, tmp_path):
    # a body and commands of its own, and a fall at the end
    parameters = WalkerParameters(hip_width=0.25, shift_time=0.2, friction_limit=0.9)
    offsets = np.where(np.arange(60) < 6, 0.01, 0.2)
    walk = Walker(parameters).walk(
        60, state=[0.0, 0.155, -0.004, -0.42, -0.07], mass_offset=offsets
    )
    assert walk.fall is not None
    walk.save(tmp_path / "walk.json")
    with PageServer(tmp_path / "walk.json") as server:
        visit = Visit(browser, f"{server.address}&{COARSE}")
        visit.press("p")
        visit.press(".", walk.n_steps + 2)
        records = visit.look(
            "leanYaw.active().walk.records.map(r => [...r.state, r.duration, ...r.contact])"
        )
        fall = visit.look("leanYaw.active().walk.current.fall.name")
        visit.close()
    records = np.array(records)
    assert np.array_equal(records[:, :5], walk.states)
    assert np.array_equal(records[:-1, 5], walk.durations)
    assert np.array_equal(records[:, 6:], walk.footprints)
    assert fall == walk.fall.value


def test_walk_in_a_notebook_is_walked_with_the_same_bits_without_any_server(browser, tmp_path):
    walk = Walker().walk(4, state=[0.0, 0.155, -0.004, -0.42, -0.07], mass_offset=0.006)
    cell = tmp_path / "cell.html"
    cell.write_text(f"<!doctype html><p>A cell.</p>{walk.show()._repr_html_()}", encoding="utf-8")
    page = browser.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(cell.as_uri())
    frame = page.frames[-1]
    frame.wait_for_function("window.leanYaw && leanYaw.active().walk.records.length > 2")
    states = frame.evaluate("leanYaw.active().walk.records.map(record => [...record.state])")
    assert np.array_equal(np.array(states)[:3, :5], walk.states[:3])
    page.close()


def test_file_that_is_no_walk_is_refused_in_words(visit, tmp_path):
    page = visit()
    (tmp_path / "other.json").write_text('{"format": "something else"}')
    page.page.locator("summary", has_text="Take it with you").click()
    page.page.locator("#share-file").set_input_files(tmp_path / "other.json")
    page.page.wait_for_function(
        "document.querySelector('#share-status').textContent.includes('not a walk')"
    )
