"""Writes channel_means.onnx: of a 16 x 16 picture, `code` = weight times the means of its three channels, shape (1, 4),
and `sum`, shape (1); and head_pose.onnx: yaw, pitch and roll in degrees, (1, 3), 90 times the means of the red, green and
blue channel. Run: python3 make_onnx.py
"""
import torch


class ChannelMeans(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.layer = torch.nn.Linear(3, 4, bias=False)
        self.layer.weight.data = torch.tensor([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 4]])

    def forward(self, picture):
        means = torch.nn.functional.adaptive_avg_pool2d(picture, 1).flatten(1)
        return means.sum(1), self.layer(means)


torch.onnx.export(ChannelMeans(), torch.zeros(1, 3, 16, 16), "channel_means.onnx", input_names=["picture"],
                  output_names=["sum", "code"], opset_version=11)


class HeadPose(torch.nn.Module):
    def forward(self, picture):
        return 90 * torch.nn.functional.adaptive_avg_pool2d(picture, 1).flatten(1)


torch.onnx.export(HeadPose(), torch.zeros(1, 3, 16, 16), "head_pose.onnx", input_names=["picture"],
                  output_names=["pose"], opset_version=11)
