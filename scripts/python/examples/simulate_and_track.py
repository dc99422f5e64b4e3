"""Simulates a scene and tracks it at once: the true force beside the one that the sensor feels."""

import domecast


def main() -> None:
    scene = domecast.Scene.load("designs/scenes/push.json", frames=5)
    tracker = domecast.Tracker(scene.sensor())
    for frame, truth in scene.frames():
        if frame is None:
            continue
        reading = tracker.update(frame, rgb=True)
        if reading.wrench is None or reading.wrench_sd is None:
            print(truth["frame"], reading.status)
            continue
        force_n, sd_n = reading.wrench[2], reading.wrench_sd[2]
        print(f"{truth['frame']}: true {truth['wrench'][2]:.3f} N, felt {force_n:.3f} +- {sd_n:.3f} N, {reading.status}")


if __name__ == "__main__":
    main()
