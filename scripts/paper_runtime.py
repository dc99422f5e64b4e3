"""The paper's runtime in Python-OpenCV (arXiv 2303.03093): whole frames, fixed levels, optical flow, plain solvePnP.

Undistort -> Gaussian blur -> circular mask -> sharpen -> grey; below a low level, opening, components, centroids and
pyramidal Lucas-Kanade to the next frame for the black markers; above a high level, opening, components, solvePnP and a
wrench linear in the pose for the white ones. `compare_tracking.py` sets it beside `domecast track`.
"""
import cv2
import numpy as np

SHARPEN = np.array([[0, -1, 0], [-1, 5, -1], [0, -1, 0]], np.float32)
SQUARE = np.ones((3, 3), np.uint8)


class PaperRuntime:
    def __init__(self, constants, black=70, white=200):
        camera, springs = constants["camera"], constants["springs"]
        self.K, self.D = np.array(camera["matrix"]), np.array(camera["distortion"], float)
        self.Ku = np.array(camera["undistorted_matrix"])
        self.fisheye = camera["model"] == "kannala_brandt"
        size = camera["width"], camera["height"]
        lens = cv2.fisheye if self.fisheye else cv2
        self.maps = lens.initUndistortRectifyMap(self.K, self.D, np.eye(3), self.Ku, size, cv2.CV_16SC2)
        mask = constants["mask"]
        center = tuple(int(round(v)) for v in mask["center_px"])
        self.mask = cv2.circle(np.zeros(size[::-1], np.uint8), center, int(mask["radius_px"]), 255, -1)
        self.S1 = np.array([m["apparent_position_mm"] for m in constants["white_markers"]])
        plain = springs["plain_runtime"]
        self.F0, self.stiffness = np.array(plain["rest_pose"]), np.array(plain["stiffness"])
        self.at = np.array(springs["at_mm"])
        rvec = cv2.Rodrigues(self.F0[:3, :3])[0]
        self.at_rest = cv2.projectPoints(self.S1, rvec, self.F0[:3, 3], self.Ku, None)[0][:, 0]
        self.black, self.white = black, white
        self.last, self.p0 = None, None

    def grey(self, frame):
        """Undistorted, blurred, masked, sharpened, grey."""
        frame = cv2.remap(frame, *self.maps, cv2.INTER_LINEAR)
        frame = cv2.GaussianBlur(frame, (3, 3), 0)
        frame = cv2.bitwise_and(frame, frame, mask=self.mask)
        frame = cv2.filter2D(frame, -1, SHARPEN)
        return cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)

    def choose_levels(self, frame, dots_px):
        """The best fixed levels for a sequence, from a frame at rest: half way between the brightest dot and the darkest
        ground beside one, and between the darkest marker and the brightest of what lies outside of it."""
        grey = self.grey(frame)
        at = lambda p: int(grey[int(round(p[1])), int(round(p[0]))]) if 0 <= p[0] < grey.shape[1] - 1 and 0 <= p[1] < grey.shape[0] - 1 else None
        dots = self.from_raw(dots_px)
        dark = [v for v in map(at, dots) if v is not None]
        step = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]) * 0.5 * np.median(
            np.sort(np.linalg.norm(dots[:, None] - dots[None], axis=2), axis=1)[:, 1])
        ground = [v for d in dots for s in step if (v := at(d + s)) is not None]
        self.black = (np.percentile(dark, 95) + np.percentile(ground, 2)) / 2
        away = self.at_rest - self.at_rest.mean(0)
        away /= np.linalg.norm(away, axis=1)[:, None]
        beside = [at(p + 16 * a) for p, a in zip(self.at_rest, away)]
        bright = [at(p) for p in self.at_rest]
        if None not in beside + bright:
            self.white = (min(bright) + max(beside)) / 2

    def step(self, frame):
        """A frame as cv2.imread gives it -> black centroids, where flow says that the last ones went, wrench."""
        grey = self.grey(frame)
        dark = cv2.bitwise_and(cv2.threshold(grey, self.black, 255, cv2.THRESH_BINARY_INV)[1], self.mask)
        dark = cv2.morphologyEx(dark, cv2.MORPH_OPEN, SQUARE)
        _, _, stats, centroids = cv2.connectedComponentsWithStats(dark)
        area = stats[:, cv2.CC_STAT_AREA]
        black = centroids[1:][(area[1:] > 6) & (area[1:] < 400)]
        flow = None
        if self.last is not None and len(self.p0):
            p1, status, _ = cv2.calcOpticalFlowPyrLK(self.last, grey, self.p0, None)
            flow = np.where(status == 1, p1[:, 0], np.nan)
        self.last, self.p0 = grey, np.float32(black)[:, None]
        return black, flow, self.wrench(grey)

    def wrench(self, grey):
        bright = cv2.threshold(grey, self.white, 255, cv2.THRESH_BINARY)[1]
        bright = cv2.morphologyEx(bright, cv2.MORPH_OPEN, SQUARE)
        centroids = cv2.connectedComponentsWithStats(bright)[3][1:]
        if len(centroids) < len(self.S1):
            return None
        away = np.linalg.norm(centroids[None] - self.at_rest[:, None], axis=2)
        P1 = centroids[away.argmin(1)]
        ok, rotation, translation = cv2.solvePnP(self.S1, P1, self.Ku, None)
        if not ok:
            return None
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(rotation)[0], translation[:, 0]
        moved = np.linalg.inv(self.F0) @ pose
        shift = moved[:3, :3] @ self.at + moved[:3, 3] - self.at
        return self.stiffness @ np.r_[shift, cv2.Rodrigues(moved[:3, :3])[0][:, 0]]

    def from_raw(self, points):
        """Places in the raw frame -> the undistorted one."""
        lens = cv2.fisheye if self.fisheye else cv2
        return lens.undistortPoints(np.array(points, float)[:, None], self.K, self.D, P=self.Ku)[:, 0]

    def to_raw(self, points):
        """Places in the undistorted frame -> the raw one."""
        rays = (np.c_[points, np.ones(len(points))] @ np.linalg.inv(self.Ku).T)[:, None]
        zero = np.zeros(3)
        if self.fisheye:
            return cv2.fisheye.projectPoints(rays, zero, zero, self.K, self.D)[0][:, 0]
        return cv2.projectPoints(rays, zero, zero, self.K, self.D)[0][:, 0]
