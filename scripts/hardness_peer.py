#!/usr/bin/env python3
"""The paper's network in PyTorch, on a set of `domecast dataset`: a second opinion on `domecast-learn --net paper`.

    hardness_peer.py SET [--out FILE] [--epochs N] [--batch N] [--rate X] [--seed N]

Torchvision's ResNet-18 with 128 features on each frame less the one at rest, a bidirectional GRU over the frames, the mean of the last
five, two classes; plain SGD at one rate, from random weights. Prints a line an epoch; writes the curve, the judgement of the test, and
the hash of the weights. Needs torch, torchvision and a CUDA card, which nothing else here needs: no test runs it.
"""
import argparse
import hashlib
import json
import pathlib
import time

import numpy as np
import torch
import torchvision

from check_dataset import read_set


def read(folder):
    """Pictures and labels of each split."""
    splits = {"train": [], "val": [], "test": []}
    for _, video in sorted(read_set(folder)[1].items()):
        picture = video["frames.npy"].astype(np.int16) - video["rest.npy"]
        splits[video["json"]["split"]].append((picture.transpose(0, 3, 1, 2), video["json"]["label"]))
    stacked = {name: (np.stack([x for x, _ in videos]), [y for _, y in videos]) for name, videos in splits.items()}
    return {name: (torch.from_numpy(x).cuda(), torch.tensor(y).cuda()) for name, (x, y) in stacked.items()}


class Net(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.eye = torchvision.models.resnet18(num_classes=128)
        self.gru = torch.nn.GRU(128, 128, bidirectional=True, batch_first=True)
        self.out = torch.nn.Linear(256, 2)

    def forward(self, pictures):
        videos, frames = pictures.shape[:2]
        seen = torch.relu(self.eye(pictures.flatten(0, 1))).view(videos, frames, -1)
        return self.out(self.gru(seen)[0][:, -5:].mean(1))


def judge(net, pictures, labels):
    net.eval()
    with torch.no_grad():
        out = torch.cat([net(pictures[at : at + 64].float() / 255) for at in range(0, len(pictures), 64)])
    net.train()
    right = int((out.argmax(1) == labels).sum())
    return {"right": right, "of": len(labels), "log_loss": torch.nn.functional.cross_entropy(out, labels).item()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("peer.json"))
    parser.add_argument("--epochs", type=int, default=50)
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--rate", type=float, default=0.001)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    torch.manual_seed(chosen.seed)
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
    splits = read(chosen.set)
    pictures, labels = splits["train"]
    net = Net().cuda()
    descent = torch.optim.SGD(net.parameters(), lr=chosen.rate)
    curve = []
    for epoch in range(1, chosen.epochs + 1):
        began, total = time.time(), 0.0
        for at in torch.randperm(len(pictures)).cuda().split(chosen.batch):
            if len(at) < 2:
                continue
            descent.zero_grad(set_to_none=True)
            loss = torch.nn.functional.cross_entropy(net(pictures[at].float() / 255), labels[at])
            loss.backward()
            descent.step()
            total += loss.item() * len(at)
        row = {"epoch": epoch, "train_loss": total / len(pictures), "val": judge(net, *splits["val"])}
        curve.append(row | {"seconds": time.time() - began})
        print(json.dumps(curve[-1]), flush=True)
    weights = hashlib.sha256()
    for value in net.state_dict().values():
        weights.update(value.cpu().numpy().tobytes())
    settings = {name: value for name, value in vars(chosen).items() if name not in ("set", "out")}
    found = {"torch": torch.__version__, **settings, "test": judge(net, *splits["test"]), "weights_sha256": weights.hexdigest()}
    chosen.out.write_text(json.dumps(found | {"curve": curve}, indent=1))
    print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
