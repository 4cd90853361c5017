"""The velocity of a sensor that moves through a room, solved from the clouds of `splid cloud`."""

import itertools
import json

import numpy as np
import pytest
from conftest import ROOT

TYPES = {("F", 4): "<f4", ("F", 8): "<f8", ("U", 4): "<u4"}
COLUMNS, ROWS = 10, 6
AZIMUTHS = np.linspace(-63, 63, COLUMNS)  # degrees, to the right
ELEVATIONS = np.linspace(25, -25, ROWS)
FIRST_MIDDLE_S = 0.025  # of the first frame
SCENE_BEGINS_S = 1_767_225_600  # UTC of a simulated recording's start

SENSOR_VELOCITY = np.array([8.0, -1.5, 0.4])  # m/s: ahead, to the left, up
TURN = np.array([0.05, -0.1, 0.3])  # rad/s
MOTION = np.hstack([SENSOR_VELOCITY, TURN])
# The room about the sensor: n x = c, m.
WALLS = {"ahead_m": ((1, 0, 0), 14), "left_m": ((0, 1, 0), 6), "right_m": ((0, -1, 0), 9),
         "up_m": ((0, 0, 1), 4), "down_m": ((0, 0, -1), 3)}
ROOM = {**{name: distance for name, (_, distance) in WALLS.items()},
        "velocity_mps": SENSOR_VELOCITY.tolist(), "turn_deg_per_s": np.degrees(TURN).tolist()}


def read_pcd(file):
    """A binary PCD as an array of its fields."""
    head, _, data = file.read_bytes().partition(b"DATA binary\n")
    lines = dict(line.split(" ", 1) for line in head.decode().splitlines() if line[0] != "#")
    kinds = zip(lines["TYPE"].split(), map(int, lines["SIZE"].split()))
    fields = list(zip(lines["FIELDS"].split(), (TYPES[kind] for kind in kinds)))
    return np.frombuffer(data, dtype=fields, count=int(lines["POINTS"]))


def directions():
    """Of the pixels, row by row from the upper left."""
    elevation, azimuth = np.radians(np.meshgrid(ELEVATIONS, AZIMUTHS, indexing="ij"))
    return np.stack([np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth),
                     np.sin(elevation)], axis=-1).reshape(-1, 3)


def seen(distances, velocities):
    """What each pixel sees, with these distances, m, in the middle of the first frame."""
    return [{"velocity_mps": v, "distance_m": z - v * FIRST_MIDDLE_S}
            for z, v in zip(distances, velocities)]


def cloud_of(sights, room, seconds, program, folder):
    """The cloud of a field. sights: what each pixel sees, with the keys of `inputs`."""
    places = itertools.product(ELEVATIONS, AZIMUTHS)
    pixels = [{"input": k + 1, "azimuth_deg": azimuth, "elevation_deg": elevation}
              for k, (elevation, azimuth) in enumerate(places)]
    inputs = [{**pixel, **sight} for pixel, sight in zip(pixels, sights)]
    config = {
        "schema": "splid.config", "v": [1, 0],
        "source": {"driver": "simulator", "pace": "max",
                   "array": {"columns": COLUMNS, "rows": ROWS, "pitch_deg": 1, "inputs": inputs,
                             "room": room}},
        "pattern": {"file": str(ROOT / "config" / "patterns" / "interleaved-180-189.json")},
        "scene": {"max_speed_mps": 20}, "pixels": pixels}
    (folder / "room.json").write_text(json.dumps(config))
    for arguments in (("simulate", "--seconds", seconds, "--output", folder / "room.ptu"),
                      ("cloud", folder / "room.ptu", "--output", folder / "room.pcd")):
        done = program.run(*arguments, "--config", folder / "room.json")
        assert done.returncode == 0, done.stderr
    return read_pcd(folder / "room.pcd")


def solved(rows, values, stds):
    """Weighted least squares: the solution and its covariance."""
    weighted = rows / stds[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted)
    return covariance @ weighted.T @ (values / stds), covariance


def squared_pull(solution, truth, covariance):
    """As chi-squared, of as many degrees of freedom as the solution has values."""
    return (solution - truth) @ np.linalg.solve(covariance, solution - truth)


def places(cloud):
    return np.stack([cloud["x"], cloud["y"], cloud["z"]], axis=-1).astype(float)


def ego_velocity(cloud):
    """What Doppler odometry minimises: v + d v_s, each point weighted by its own deviation."""
    d = places(cloud)
    d /= np.linalg.norm(d, axis=1)[:, None]
    return solved(d, -cloud["radial_velocity"], cloud["std_radial_velocity"])


@pytest.mark.slow
def test_surfaces_that_face_the_sensor_give_its_velocity(program, tmp_path):
    d = directions()
    distances = np.random.default_rng(1).uniform(5, 40, len(d))
    cloud = cloud_of(seen(distances, -d @ SENSOR_VELOCITY), {}, 0.52, program, tmp_path)
    times = np.unique(cloud["time"])
    assert len(times) >= 10 and len(cloud) >= 0.99 * len(times) * len(d)
    pulls = []
    for time in times:
        velocity, covariance = ego_velocity(cloud[cloud["time"] == time])
        pulls.append(squared_pull(velocity, SENSOR_VELOCITY, covariance))
        assert np.sqrt(np.diag(covariance)).max() < 0.05
    # Of 3 degrees of freedom each: 30 with a deviation of 7.7 for ten frames.
    expected = 3 * len(pulls)
    assert sum(pulls) == pytest.approx(expected, abs=4 * np.sqrt(2 * expected))


def wall_met(sensor, rays):
    """Which wall each ray from the sensor meets, along the axes of the start."""
    normals, offsets = (np.array(side, dtype=float) for side in zip(*WALLS.values()))
    along = rays @ normals.T
    with np.errstate(divide="ignore"):
        reach = np.where(along > 1e-9, (offsets - sensor @ normals.T) / along, np.inf)
    return reach.argmin(axis=1)


def facing_walls(points, of_wall):
    """For each point the normal of its wall, away from the sensor: of the plane through the wall's
    points."""
    found = np.zeros_like(points)
    for k in np.unique(of_wall):
        on_wall = points[of_wall == k]
        assert len(on_wall) >= 4
        normal = np.linalg.svd(on_wall - on_wall.mean(axis=0))[2][2]
        found[of_wall == k] = normal * np.sign(normal @ on_wall[0])
    return found


def motion_by(normals, points, cloud):
    """Velocity and turn of the sensor, and their covariance: v (n d) + n (v_s + w x p) = 0."""
    along = (normals * points).sum(axis=1) / np.linalg.norm(points, axis=1)
    return solved(np.hstack([normals, np.cross(points, normals)]),
                  -along * cloud["radial_velocity"], along * cloud["std_radial_velocity"])


def test_walls_give_velocity_and_turn_with_their_normals(program, tmp_path):
    cloud = cloud_of([{}] * COLUMNS * ROWS, ROOM, 0.052, program, tmp_path)
    assert len(cloud) >= 58
    points = places(cloud)
    found = facing_walls(points, wall_met(np.zeros(3), directions()[cloud["pixel"]]))
    motion, covariance = motion_by(found, points, cloud)
    # Of 6 degrees of freedom: 1e-5 of chance.
    assert squared_pull(motion, MOTION, covariance) < 32
    assert np.sqrt(np.diag(covariance))[:3].max() < 0.1
    # An oblique wall slides along under a pixel, of which v + d v_s knows nothing.
    velocity, covariance = ego_velocity(cloud)
    assert squared_pull(velocity, SENSOR_VELOCITY, covariance) > 1000


SCAN_COLUMNS, SCAN_ROWS, SCAN_PITCH_DEG, DWELL_S = 8, 6, 4.0, 0.005
LINE_S = SCAN_COLUMNS * DWELL_S
PICTURE_S = SCAN_ROWS * LINE_S


SIDE_DEG, TOP_DEG = (SCAN_PITCH_DEG * (n - 1) / 2 for n in (SCAN_COLUMNS, SCAN_ROWS))


def scale(columns, rows, pitch_deg):
    """The directions of a scan's columns and lines, from the first to the last."""
    side_deg, top_deg = (pitch_deg * (n - 1) / 2 for n in (columns, rows))
    return {"lines": rows, "azimuth_deg": [-side_deg, side_deg],
            "elevation_deg": [top_deg, -top_deg]}


def scan_cloud(grid, seconds, program, folder, scan=None, source={}, scanner={}):
    """The cloud of a scan of the room there and back, without a return, and what the program said.
    grid: columns, rows, pitch. source, scanner: further keys."""
    config = {
        "schema": "splid.config", "v": [1, 0],
        "source": {"driver": "simulator", "pace": "max", **source,
                   "scanner": {"dwell_ms": 1e3 * DWELL_S, "both_ways": True, **scanner},
                   "array": {**dict(zip(("columns", "rows", "pitch_deg"), grid)),
                             "room": {**ROOM, "signal_per_pulse": 0.02}}},
        "pattern": {"file": str(ROOT / "config" / "patterns" / "interleaved-180-189.json")},
        "scene": {"max_speed_mps": 20},
        "frame": {"length_ms": 1e3 * DWELL_S}, "scan": scan or scale(*grid)}
    (folder / "scan.json").write_text(json.dumps(config))
    for arguments in (("simulate", "--seconds", seconds, "--output", folder / "scan.ptu"),
                      ("cloud", folder / "scan.ptu", "--output", folder / "scan.pcd")):
        done = program.run(*arguments, "--config", folder / "scan.json")
        assert done.returncode == 0, done.stderr
    return read_pcd(folder / "scan.pcd"), done.stderr


def scan_of_room(start_ms, seconds, program, folder, scan=None, source={}, scanner={}):
    """The points of a scan, the errors of each over its deviations by the simulated truth, and what
    the program said."""
    cloud, said = scan_cloud((SCAN_COLUMNS, SCAN_ROWS, SCAN_PITCH_DEG), seconds, program, folder,
                             scan, source, {"start_ms": start_ms, **scanner})
    distances = np.linalg.norm(places(cloud), axis=1)
    column = (SIDE_DEG - np.degrees(np.arctan2(cloud["y"], cloud["x"]))) / SCAN_PITCH_DEG
    row = (TOP_DEG - np.degrees(np.arcsin(cloud["z"] / distances))) / SCAN_PITCH_DEG
    assert np.abs(column - np.rint(column)).max() < 1e-3 > np.abs(row - np.rint(row)).max()
    pixels = (np.rint(row) * SCAN_COLUMNS + np.rint(column)).astype(int)
    seconds = cloud["time"] - SCENE_BEGINS_S
    truth = json.loads((folder / "scan.truth.json").read_text())
    looked_at = [truth["pixels"][pixel] for pixel in pixels]
    since_first = seconds - 1e-12 * np.array([pixel["first_ps"] for pixel in looked_at])
    samples = np.rint(since_first / (1e-12 * truth["step_ps"])).astype(int)
    pulls = [[(value - pixel[name][sample]) / std for value, pixel, sample, std
              in zip(values, looked_at, samples, cloud[deviation])]
             for name, values, deviation in (
                 ("distance_m", distances, "std_distance"),
                 ("velocity_mps", cloud["radial_velocity"], "std_radial_velocity"))]
    return pixels, seconds, np.array(pulls), said


def picture_order():
    """The pixels of a picture in the order of time."""
    grid = np.arange(SCAN_ROWS * SCAN_COLUMNS).reshape(SCAN_ROWS, SCAN_COLUMNS)
    grid[1::2] = grid[1::2, ::-1]
    return grid.reshape(-1)


def test_each_dwell_of_a_scan_is_a_point_where_the_scanner_looked(program, tmp_path):
    pixels, seconds, pulls, said = scan_of_room(10, 0.01 + 2 * PICTURE_S + 5e-3, program, tmp_path)
    # Two pictures, and the begin of a third, whose line has no end.
    assert pixels.tolist() == 2 * picture_order().tolist()
    assert seconds == pytest.approx(0.01 + DWELL_S * (0.5 + np.arange(len(pixels))), abs=1e-5)
    assert f"{len(pixels)} points of {len(pixels)} frames" in said
    assert (pulls**2).mean(axis=1) == pytest.approx([1, 1], abs=4 * np.sqrt(2 / len(pixels)))


def poses(motion, seconds):
    """Where a sensor of this velocity and turn, along its own axes, has turned and moved to."""
    velocity, turn = motion[:3], motion[3:]
    rate = max(np.linalg.norm(turn), 1e-9)
    across = np.cross(turn / rate, np.eye(3)).T
    t, angle = seconds[:, None, None], rate * seconds[:, None, None]
    turned, back = 1 - np.cos(angle), across @ across
    path = t * np.eye(3) + turned / rate * across + (t - np.sin(angle) / rate) * back
    return np.eye(3) + np.sin(angle) * across + turned * back, path @ velocity


def apply(turns, vectors):
    return (turns @ vectors[:, :, None])[:, :, 0]


def test_a_scan_of_a_room_gives_the_sensors_velocity_and_turn(program, tmp_path):
    grid = (16, 8, 8.0)
    cloud, _ = scan_cloud(grid, grid[0] * grid[1] * DWELL_S + 1e-3, program, tmp_path)
    assert len(cloud) == grid[0] * grid[1]
    points, seconds = places(cloud), cloud["time"] - SCENE_BEGINS_S
    turns, path = poses(MOTION, seconds)
    of_wall = wall_met(path, apply(turns, points))
    # The sensor moves by 5 m in a picture: walls are flat once the points are put together by the
    # motion that they tell of.
    motion = np.zeros(6)
    for _ in range(6):
        turns, path = poses(motion, seconds - seconds.mean())
        together = facing_walls(apply(turns, points) + path, of_wall)
        motion, covariance = motion_by(apply(turns.transpose(0, 2, 1), together), points, cloud)
    assert squared_pull(motion, MOTION, covariance) < 32
    assert np.sqrt(np.diag(covariance))[:3].max() < 0.1


def test_angles_read_at_the_ticks_of_an_encoder_give_each_point_its_place(program, tmp_path):
    # Two ticks come before a dwell's middle, and two after it.
    start_s, first_tick_s, tick_s = 0.01, 0.0006, 0.00125
    since_s = first_tick_s + tick_s * np.arange(1000) - start_s
    looked_at = np.array(picture_order())[np.floor(since_s / DWELL_S).astype(int)
                                          % (SCAN_ROWS * SCAN_COLUMNS)]
    angles = np.stack([SCAN_PITCH_DEG * (looked_at % SCAN_COLUMNS) - SIDE_DEG,
                       TOP_DEG - SCAN_PITCH_DEG * (looked_at // SCAN_COLUMNS)], axis=-1)
    np.savetxt(tmp_path / "angles.csv", angles, delimiter=",", header="azimuth_deg,elevation_deg",
               comments="")
    pixels, _, pulls, _ = scan_of_room(
        1e3 * start_s, start_s + PICTURE_S + 1e-3, program, tmp_path, {"angles": "angles.csv"},
        {"encoder_rate_hz": 1 / tick_s, "encoder_start_s": first_tick_s},
        {"line_start_marker": 2, "line_stop_marker": 4, "frame_marker": 8})
    assert pixels.tolist() == picture_order().tolist()
    assert np.abs(pulls).max() < 6


def test_a_picture_that_begins_before_the_recording_moves_no_other(program, tmp_path):
    # The recording begins in the middle of line 2.
    start_s = -2.5 * LINE_S
    pixels, seconds, pulls, said = scan_of_room(1e3 * start_s, start_s + 2 * PICTURE_S + 1e-3,
                                                program, tmp_path)
    whole = seconds > start_s + PICTURE_S
    assert pixels[whole].tolist() == picture_order().tolist()
    assert np.abs(pulls[:, whole]).max() < 6
    assert f"{9 * SCAN_COLUMNS} frames" in said  # lines 3, 4 and 5, and then all six
