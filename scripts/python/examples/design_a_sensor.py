"""Edits a design, looks at what each pixel of a row sees, and names a fault's field."""

import numpy as np

import domecast


def main() -> None:
    design = domecast.Design.load("designs/thumb24.json")
    design["leds"]["tilt_deg"] = 80
    layout = design.layout()
    print(f"{design.name}: {len(layout)} dots, {layout.pitch_px:.1f} px apart, the largest {layout.dots['diameter_mm'].max():.2f} mm")
    uv = np.stack([np.linspace(100, 540, 5), np.full(5, 240.0)], axis=1)
    xyz, status = design.optics().trace(uv)
    for pixel, point, word in zip(uv, xyz.round(3), status):
        print(pixel, word, point)
    design["dome"]["radius_mm"] = -3
    try:
        design.layout()
    except domecast.DomecastError as error:
        print(f"{error.field}: {error.problem}; allowed: {error.allowed}")


if __name__ == "__main__":
    main()
