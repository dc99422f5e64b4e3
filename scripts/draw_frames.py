"""A second renderer: frames of a sensor from its constants, by NumPy and OpenCV alone.

Its projector shares nothing with domecast: a point is carried into the platform's frame, the angle at which its ray leaves
the layers is found by Newton's method on Snell's law, and the lens is OpenCV's formulas written out. Dots and markers are polygons
filled at four times the frame's resolution. A skin that moves is a function from places on the dome to places in the sensor
frame.
"""
import copy

import cv2
import numpy as np

FINE = 4
RIM = 40
MAX_STEPS, MAX_MISS_MM = 60, 1e-11


def rotation(vector):
    return cv2.Rodrigues(np.asarray(vector, float))[0]


class Sensor:
    def __init__(self, constants):
        self.constants = constants
        camera = constants["camera"]
        self.size = camera["width"], camera["height"]
        self.matrix = np.array(camera["matrix"])
        self.model, self.distortion = camera["model"], list(camera["distortion"]) + [0.0] * 8
        transform = np.array(camera["camera_from_sensor"])
        self.camera_rotation = transform[:3, :3]
        self.pupil = -transform[:3, :3].T @ transform[:3, 3]
        layers = [layer for layer in constants["optics"]["layers"] if layer["name"] != "air"]
        self.sheets = [(layer["index"], layer["thickness_mm"]) for layer in layers if layer["thickness_mm"] is not None]
        self.fill = [layer["index"] for layer in layers if layer["thickness_mm"] is None][0]
        self.radius = constants["optics"]["dome_radius_mm"]
        # the sphere's centre: below the sheet's top for a cap
        self.center = np.array([0, 0, constants["optics"].get("dome_center_z_mm", 0.0)])
        dots = constants["black_dots"]
        self.ids = np.array([dot["id"] for dot in dots])
        self.dots = np.array([dot["surface_mm"] for dot in dots])
        self.diameters = np.array([dot["diameter_mm"] for dot in dots])
        self.markers = np.array([marker["position_mm"] for marker in constants["white_markers"]]).reshape(-1, 3)
        self.marker_diameters = [marker["diameter_mm"] for marker in constants["white_markers"]]
        y, x = np.ogrid[:self.size[1], :self.size[0]]
        away = (x - self.matrix[0, 2]) ** 2 + (y - self.matrix[1, 2]) ** 2
        self.shade = (1 - 0.25 * away / self.size[1]**2).astype(np.float32)

    def project(self, points, turn=(0, 0, 0), shift=(0, 0, 0)):
        """Pixels of points in the sensor frame, the platform turned (rotation vector) and shifted (mm) from rest."""
        platform = rotation(turn)
        points = np.asarray(points, float)
        pupil = platform.T @ (self.pupil - np.asarray(shift, float))
        across = points[..., :2] - pupil[:2]
        reach = np.hypot(across[..., 0], across[..., 1])
        sheet = sum(thickness for _, thickness in self.sheets)
        air = -pupil[2] - sheet
        # Newton's method for the tangent in air, from the axis: what a ray reaches is concave in it, so that no step goes too far.
        tangent = np.zeros_like(reach)
        for _ in range(MAX_STEPS):
            there, slope = air * tangent, np.full_like(reach, air)
            for index, thickness in self.sheets + [(self.fill, None)]:
                depth = points[..., 2] if thickness is None else thickness
                inner = 1 / np.sqrt(index**2 + (index**2 - 1) * tangent**2)
                there += depth * tangent * inner
                slope += depth * index**2 * inner**3
            tangent += (reach - there) / slope
            if np.abs(reach - there).max() < MAX_MISS_MM:
                break
        else:
            raise ArithmeticError("no ray reaches a point")
        angle = np.arctan(tangent)
        unit = across / np.maximum(reach, 1e-300)[..., None]
        ray = np.concatenate([unit * np.sin(angle)[..., None], np.cos(angle)[..., None]], -1)
        return self.lens(ray @ platform.T @ self.camera_rotation.T)

    def lens(self, ray):
        k = self.distortion
        if self.model == "kannala_brandt":
            across = np.hypot(ray[..., 0], ray[..., 1])
            angle = np.arctan2(across, ray[..., 2])
            bent = angle * (1 + sum(k[i] * angle ** (2 * i + 2) for i in range(4)))
            flat = ray[..., :2] * (bent / np.maximum(across, 1e-300))[..., None]
        else:
            x, y = ray[..., 0] / ray[..., 2], ray[..., 1] / ray[..., 2]
            r2 = x * x + y * y
            if self.model == "pinhole":
                k = [0.0] * 8
            radial = (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])))
            flat = np.stack([x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
                             y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y], -1)
        return flat @ self.matrix[:2, :2].T + self.matrix[:2, 2]

    def outlines(self):
        """Rims of the dots on the undeformed dome, and of the markers on the sheet."""
        turn = np.linspace(0, 2 * np.pi, RIM, endpoint=False)
        normal = self.dots - self.center
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        east = np.cross([0, 0, 1], normal)
        length = np.linalg.norm(east, axis=1, keepdims=True)
        east = np.where(length > 1e-9, east / np.maximum(length, 1e-9), [1, 0, 0])
        north = np.cross(normal, east)
        wheel = east[:, None] * np.cos(turn)[:, None] + north[:, None] * np.sin(turn)[:, None]
        rims = self.dots[:, None] + 0.5 * self.diameters[:, None, None] * wheel
        rims -= self.center
        rims *= (self.radius / np.linalg.norm(rims, axis=2))[..., None]
        rims += self.center
        flat = np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1)
        markers = [p + 0.5 * d * flat for p, d in zip(self.markers, self.marker_diameters)]
        return rims, markers

    def draw(self, turn=(0, 0, 0), shift=(0, 0, 0), skin=None, without=(), hidden=(), specks=(), noise=1.0, seed=1, white=235):
        """A frame, and the centroids of its dots. `skin`: from places on the dome to places in the sensor frame; `without`:
        dots that came out not at all; `hidden`: markers under a cover; `specks`: dirt as (place on the dome, diameter);
        `white`: the markers' level, where 60 is what is around them."""
        width, height = self.size
        # levels are whole numbers; the light changes by a thousandth over a pixel, so that it may come after
        fine = np.full((height * FINE, width * FINE), 60, np.uint8)
        around = np.linspace(0, 2 * np.pi, 240, endpoint=False)
        rim_radius = np.sqrt(self.radius**2 - min(self.center[2], 0.0) ** 2)
        rim = rim_radius * np.stack([np.cos(around), np.sin(around), 0 * around], -1)

        def fill(outlines, level):
            # the centre of a pixel is a whole number; of a fine one, at (i + 0.5) / FINE - 0.5
            outlines = np.round(((np.asarray(outlines) + 0.5) * FINE - 0.5) * 16).astype(np.int32)
            for corners in outlines:
                # one by one: where two lie over each other, one call would leave a hole
                cv2.fillPoly(fine, [corners], level, cv2.LINE_8, 4)

        def seen(points):
            return self.project(skin(points) if skin else points, turn, shift)

        fill(self.project(rim, turn, shift)[None], 165)
        rims, markers = self.outlines()
        pixels = seen(rims)
        ahead = np.roll(pixels, -1, 1)
        cross = pixels[..., 0] * ahead[..., 1] - ahead[..., 0] * pixels[..., 1]
        centers = ((pixels + ahead) * cross[..., None]).sum(1) / (3 * cross.sum(1))[:, None]
        fill(np.delete(pixels, list(without), axis=0), 25)
        for place, diameter in specks:
            spot = copy.copy(self)
            spot.dots, spot.diameters = np.asarray(place, float)[None], np.array([diameter])
            fill(seen(spot.outlines()[0]), 25)
        fill([self.project(corners, turn, shift) for index, corners in enumerate(markers) if index not in hidden], white)
        frame = cv2.resize(fine.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA) * self.shade
        frame = cv2.GaussianBlur(frame, (0, 0), 0.6)
        frame += np.random.default_rng(seed).normal(0, noise, frame.shape)
        return np.clip(np.round(frame), 0, 255).astype(np.uint8), centers


def turn_picture(frame, clockwise_deg, mirrored, center):
    """A picture mirrored left to right about the centre, then turned clockwise about it."""
    height, width = frame.shape[:2]
    cx, cy = center
    flip = np.array([[-1, 0, 2 * cx], [0, 1, 0], [0, 0, 1]]) if mirrored else np.eye(3)
    angle = np.radians(clockwise_deg)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, cx - c * cx + s * cy], [s, c, cy - s * cx - c * cy], [0, 0, 1]])
    matrix = (turn @ flip)[:2]
    return cv2.warpAffine(frame, matrix, (width, height), flags=cv2.INTER_CUBIC, borderValue=int(frame[0, 0])), matrix
