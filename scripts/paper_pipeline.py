"""The paper's white-marker pipeline with OpenCV: frames in, wrench out.

    python3 scripts/paper_pipeline.py [--white LEVEL] output/thumb24/constants/opencv.yaml frame_0000.png ...

`--white` is the threshold above which a pixel is white: 200 of 255 under even light from outside; 60 under thumb24's own.
"""
import sys
import cv2
import numpy as np

words = sys.argv[1:]
level = int(words[1]) if words[:1] == ["--white"] else 200
constants, *frames = words[2:] if words[:1] == ["--white"] else words
store = cv2.FileStorage(constants, cv2.FileStorage_READ)
K, D, Ku, center, S1, F0, stiffness, at = (store.getNode(name).mat() for name in (
    "camera_matrix", "distortion_coefficients", "undistorted_matrix", "mask_center_px",
    "apparent_white_markers_mm", "plain_rest_pose", "plain_stiffness", "springs_at_mm"))
size = int(store.getNode("image_width").real()), int(store.getNode("image_height").real())
lens = cv2.fisheye if store.getNode("camera_model").string() == "kannala_brandt" else cv2
maps = lens.initUndistortRectifyMap(K, D, np.eye(3), Ku, size, cv2.CV_32FC1)
mask = cv2.circle(np.zeros(size[::-1], np.uint8), np.rint(center[0]).astype(int).tolist(),
                  int(store.getNode("mask_radius_px").real()), 255, -1)
at_rest = cv2.projectPoints(S1, cv2.Rodrigues(F0[:3, :3])[0], F0[:3, 3], Ku, None)[0][:, 0]

for path in frames:
    frame = cv2.GaussianBlur(cv2.remap(cv2.imread(path), *maps, cv2.INTER_LINEAR), (3, 3), 0)
    grey = cv2.bitwise_and(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), mask)
    white = cv2.morphologyEx((grey > level).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3)))
    centroids = cv2.connectedComponentsWithStats(white)[3][1:]
    if len(centroids) < len(S1):
        print(path, "sees", len(centroids), "of", len(S1), "white markers")
        continue
    P1 = np.array([centroids[np.argmin(np.linalg.norm(centroids - p, axis=1))] for p in at_rest])
    _, rotation, translation = cv2.solvePnP(S1, P1, Ku, None)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(rotation)[0], translation[:, 0]
    moved = np.linalg.inv(F0) @ pose
    shift = moved[:3, :3] @ at[0] + moved[:3, 3] - at[0]
    wrench = stiffness @ np.r_[shift, cv2.Rodrigues(moved[:3, :3])[0][:, 0]]
    print(path, "Fx Fy Fz (N) Mx My Mz (N*mm):", np.round(wrench, 3).tolist())
