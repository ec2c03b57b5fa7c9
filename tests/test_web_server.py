"""The page's server on the loopback interface, and saved walks."""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
import urllib.error
import urllib.request

import numpy as np
import pytest

import agents
from agents import AGENTS, shipped_seeds
from agents.policies.policy_files import shipped_folder
from lean_yaw_env import Walker, WalkerParameters, find_limit_cycle
from lean_yaw_env.analysis import find_passive_gaits
from lean_yaw_env.passive import PassiveWalker
from lean_yaw_env.registration import ENV_IDS
from lean_yaw_env.viewer import PAGE, PageServer, write_page


def answer(address, **headers):
    """Status and body of an address."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as response:
            return response.status, response.read()
    except urllib.error.HTTPError as error:
        return error.code, b""


def test_server_gives_the_page_and_all_that_it_names():
    with PageServer() as server:
        status, page = answer(server.address)
        assert status == 200
        for name in re.findall(r'(?:src|href)="\./([^"]+)"', page.decode()):
            assert answer(server.address + name) == (200, (PAGE / name).read_bytes())


def test_server_listens_on_the_loopback_interface_only():
    with PageServer() as server:
        assert server._server.server_address[0] == "127.0.0.1"


def test_server_answers_nothing_under_another_machines_name():
    with PageServer() as server:
        assert answer(server.address, Host="example.org")[0] == 403


def test_server_gives_nothing_outside_the_page_and_lists_no_folder(tmp_path):
    with PageServer() as server:
        assert answer(server.address + "assets/")[0] == 404
        assert answer(server.address + "../server.py")[0] == 404
        assert answer(server.address + "walk.json")[0] == 404


def test_server_gives_the_walk_that_it_was_given(tmp_path):
    walk = Walker(WalkerParameters()).walk(3, state=[0.0, 0.155, -0.004, -0.42, -0.07])
    walk.save(tmp_path / "mine.json")
    with PageServer(tmp_path / "mine.json") as server:
        base, opened = server.address.split("#")
        assert opened == "walk=./walk.json"
        assert answer(base + "walk.json") == (200, (tmp_path / "mine.json").read_bytes())


def test_missing_walk_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no walk at"):
        PageServer(tmp_path / "none.json")


def test_server_gives_every_trained_agent_that_is_installed_and_an_index_of_them():
    with PageServer() as server:
        index = json.loads(answer(server.address + "agents/index.json")[1])
        for env_id in ENV_IDS:
            task = env_id.split("/")[1]
            offered = index["agents"].get(task, {})
            for algorithm, entry in offered.items():
                assert entry["seeds"] == shipped_seeds(env_id, algorithm)
                policy = agents.load(env_id, algorithm=algorithm, seed=entry["seeds"][0])
                assert entry["observation"] == list(policy.card.layout.names)
                assert np.isfinite(list(entry["means"].values())).all()
            assert set(offered) == {name for name in AGENTS if shipped_seeds(env_id, name)}
        file = shipped_folder("LeanYaw/Slalom-v1", "ppo", 0) / "policy.safetensors"
        place = "agents/Slalom-v1/ppo/seed0/policy.safetensors"
        assert answer(server.address + place) == (200, file.read_bytes())
        assert answer(server.address + "agents/../references.json")[0] == 404
        assert answer(server.address + "agents/Slalom-v1/")[0] == 404


def test_server_opens_a_task_with_the_agents_asked_for():
    with PageServer(task="Slalom", agents=["ppo", "you"]) as server:
        assert server.address.split("#")[1] == "tab=tasks&task=Slalom&walkers=ppo,you"
    with PageServer(task="Walk") as server:
        assert server.address.split("#")[1] == "tab=tasks&task=Walk"


def test_server_gives_a_policy_of_ones_own_and_nothing_else_of_its_folder(tmp_path):
    agents.save(agents.load("LeanYaw/Slalom-v1"), tmp_path)
    (tmp_path / "secret.txt").write_text("x")
    with PageServer(policy=tmp_path, agents=["fixed"]) as server:
        base, opened = server.address.split("#")
        assert opened == "tab=tasks&task=Slalom&walkers=fixed,own&policy=own/policy"
        for name in ("policy.json", "policy.safetensors"):
            assert answer(f"{base}own/{name}") == (200, (tmp_path / name).read_bytes())
        assert answer(f"{base}own/secret.txt")[0] == 404


def test_what_the_page_cannot_show_is_refused(tmp_path):
    with pytest.raises(ValueError, match="task must be one of"):
        PageServer(task="Slalon")
    with pytest.raises(ValueError, match="agent must be one of"):
        PageServer(task="Slalom", agents=["her"])
    with pytest.raises(ValueError, match="give task too"):
        PageServer(agents=["ppo"])
    with pytest.raises(FileNotFoundError, match=r"no policy\.json in"):
        PageServer(policy=tmp_path, task="Slalom")
    agents.save(agents.load("LeanYaw/Slalom-v1"), tmp_path)
    with pytest.raises(ValueError, match="is for Slalom, and task is 'Walk'"):
        PageServer(policy=tmp_path, task="Walk")
    agents.save(agents.load("LeanYaw/WaypointGoal-v1"), tmp_path)
    with pytest.raises(ValueError, match="is for LeanYaw/WaypointGoal-v1"):
        PageServer(policy=tmp_path)
    with pytest.raises(ValueError, match="give one of them"):
        PageServer(tmp_path / "walk.json", task="Slalom")


def test_page_written_for_a_static_host_has_its_agents_beside_it(tmp_path):
    write_page(tmp_path)
    for file in PAGE.rglob("*"):
        assert (
            file.is_dir() or (tmp_path / file.relative_to(PAGE)).read_bytes() == file.read_bytes()
        )
    index = json.loads((tmp_path / "agents" / "index.json").read_text())
    for task, offered in index["agents"].items():
        for algorithm, entry in offered.items():
            for seed in entry["seeds"]:
                assert (
                    tmp_path / "agents" / task / algorithm / f"seed{seed}" / "policy.json"
                ).exists()


def test_page_loads_in_less_than_a_megabyte():
    """Compressed, as hosts send it, and without agents, which are read when they are asked for."""
    sizes = {
        file.name: len(gzip.compress(file.read_bytes()))
        for file in PAGE.rglob("*")
        if file.is_file()
    }
    assert sum(sizes.values()) < 1_000_000, sizes


def test_saved_walk_holds_every_number_exactly(tmp_path):
    angles = np.linspace(0.28, 0.32, 5)
    walk = Walker(WalkerParameters(hip_width=0.25)).walk(
        5, state=[0.0, 0.155, -0.004, -0.42, -0.07], inter_leg_angle=angles, mass_offset=0.01
    )
    walk.save(tmp_path / "walk.json")
    saved = json.loads((tmp_path / "walk.json").read_text())
    assert np.array_equal(saved["states"], walk.states)
    assert saved["inter_leg_angles"] == angles.tolist()
    assert saved["commanded_offsets"] == [0.01] * 5
    assert saved["mass_offsets"] == walk.mass_offsets.tolist()
    assert saved["parameters"]["hip_width"] == 0.25


def test_walk_is_saved_as_json_only(tmp_path):
    walk = Walker(WalkerParameters()).walk(1, state=[0.0, 0.155, -0.004, -0.42, -0.07])
    with pytest.raises(ValueError, match=r"must end with one of \.json"):
        walk.save(tmp_path / "walk.csv")


def unpacked(packed):
    return gzip.decompress(base64.b64decode(packed))


def test_a_walk_in_a_notebook_is_one_document_with_the_whole_page_in_it():
    walk = Walker().walk(3, state=[0.0, 0.155, -0.004, -0.42, -0.07])
    shown = walk.show(height=500)._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and 'height="500"' in shown
    document = html.unescape(re.search(r'srcdoc="([^"]*)"', shown)[1])
    files = json.loads(re.search(r"of (\[\[.*?\]\])\) {", document)[1])
    assert {name for name, _, _ in files} == {path.name for path in (PAGE / "assets").iterdir()}
    contents = {name: unpacked(packed) for name, _, packed in files}
    for name, content in contents.items():
        assert content == (PAGE / "assets" / name).read_bytes()
    page = unpacked(re.search(r'unpacked\("([^"]*)"\)', document)[1]).decode()
    assert page == (PAGE / "index.html").read_text(encoding="utf-8")
    saved = json.loads(re.search(r"\.open\((\{.*?\})\s*\);", document, re.DOTALL)[1])
    assert saved["states"] == walk.states.tolist()
    # What names another file does so in a way that the document knows, and is unpacked after it
    texts = [content.decode() for name, content in contents.items() if not name.endswith(".wasm")]
    for k, name in enumerate(contents):
        names = [f"new URL(`{name}`,import.meta.url).href", f"./assets/{name}"]
        users = [text for text in (*texts, page) if name in text]
        assert users and all(any(way in text for way in names) for text in users)
        earlier = [content for content in list(contents.values())[: k + 1]]
        assert not any(name.encode() in content for content in earlier)


def test_a_gait_is_shown_as_a_walk_of_it_and_a_passive_one_is_refused():
    gait = find_limit_cycle(Walker())
    saved = json.loads(gait.show(n_steps=5).walk)
    assert len(saved["inter_leg_angles"]) == 5
    # the gait recurs to its residual, about 1e-12, grown over five steps
    np.testing.assert_allclose(saved["states"][4], gait.state, atol=1e-10)
    passive = find_passive_gaits(
        PassiveWalker(WalkerParameters(hip_width=0.0, foot_radius=0.0, slope=0.009), planar=True)
    )
    with pytest.raises(ValueError, match="only a Walker's gait can be shown"):
        passive[0].show()
