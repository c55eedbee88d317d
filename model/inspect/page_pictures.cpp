#include "model/inspect/page_pictures.h"

#include <algorithm>

#include "model/body/uv_atlas.h"
#include "model/train/boxes.h"

namespace degas {
namespace {

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

PagePicture jpeg_picture(const Image8& picture, const std::string& caption) {
  return {text_of(encode_image(picture, ".jpg")), caption};
}

Image8 side_by_side(const std::vector<Image8>& pictures) {
  int width = 0;
  for (const Image8& picture : pictures) width += picture.width;
  Image8 out = Image8::black(width, pictures.front().height, pictures.front().channels);
  int left = 0;
  for (const Image8& picture : pictures) {
    for (int y = 0; y < picture.height; ++y) {
      std::copy_n(picture.at(0, y), picture.width * picture.channels, out.at(left, y));
    }
    left += picture.width;
  }
  return out;
}

Image8 face_crop(const Image8& picture, const BodyModel& body, const Pose& pose, const std::vector<double>& betas,
                 const Camera& view) {
  const std::optional<Rectangle> box = face_box(body, pose, betas, view);
  if (!box) return {};
  const int side = std::max({box->width, box->height, 1});
  const Image8 square =
      cropped(picture, box->left + box->width / 2 - side / 2, box->top + box->height / 2 - side / 2, side, side);
  return resized(square, 112, 112);
}

AtlasPicture atlas_picture(const BodyModel& body) {
  constexpr int side = 256;
  const UvAtlas atlas(body, side);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(body.faces(), body.canonical_vertices({}, {}));
  const std::vector<float> map = atlas.map(normals);
  const std::vector<bool> head = head_triangles(body);
  Image8 picture = Image8::black(side, side, 3);
  std::fill(picture.pixels.begin(), picture.pixels.end(), uint8_t{245});
  for (const int index : atlas.covered()) {
    const auto texel = static_cast<size_t>(index);
    const bool is_head = head[static_cast<size_t>(atlas.texels()[texel].triangle)];
    const float light = 0.65F + 0.35F * map[3 * texel + 2];
    const std::array<float, 3> colour =
        is_head ? std::array<float, 3>{240, 160, 70} : std::array<float, 3>{110, 150, 190};
    for (size_t c = 0; c < 3; ++c) picture.pixels[3 * texel + c] = static_cast<uint8_t>(light * colour[c]);
  }
  const FaceRegion region = find_face_region(body);
  for (int i = 0; i < side / 2; ++i) {
    for (const auto& [x, y] : {std::pair(i, 0), {0, i}, {i, side / 2 - 1}, {side / 2 - 1, i}}) {
      uint8_t* pixel = picture.at(region.left(side) + x, region.top(side) + y);
      pixel[0] = 200, pixel[1] = 30, pixel[2] = 30;
    }
  }
  return {text_of(encode_image(picture, ".png")), region};
}

}  // namespace degas
