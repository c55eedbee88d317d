#pragma once

#include "model/data/mannequin_body.h"
#include "model/data/mannequin_renderer.h"

namespace degas {

enum class MannequinMaterial { Skin, Hair, Shirt, Trousers, Shoe, Eye, Mouth, Teeth };

/// What covers the body at a point of the canonical surface.
MannequinMaterial mannequin_material(MannequinChart chart, const Eigen::Vector3d& rest);

/// 0 on bare skin .. 1 well inside the hair.
double hair_amount(const Eigen::Vector3d& rest);

/// Distance along the arm (metres, shoulder = 0) of a point, either side.
double along_arm(const Eigen::Vector3d& rest);

/// Smooth noise in -1..1 with features of size 1; the same everywhere.
double value_noise(const Eigen::Vector3d& position);

/// Paints skin, face, hair, shirt, jeans and shoes over the atlas, `size` texels wide, with borders grown into the
/// gutters.
MannequinTexture paint_mannequin(const MannequinBody& body, int size);

}  // namespace degas
