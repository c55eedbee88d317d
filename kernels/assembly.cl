// Gaussians from the decoder's maps at the covered texels, and the way back.
// Shapes: maps NHWC with R x R texels: position_map C = 3, rotation_map C = 7 (quaternion w x y z, then log-scale),
// color_map C = 4 (colour, then opacity logit), map of harmonics C = channels. texels Int32 (N), each texel at most
// once; all others (N,C).
// Launch: one item per Gaussian, local size free. The backward kernels write the covered texels of gradient maps that
// the host has filled with zeros. Deterministic: no element is written twice.
#include "common/real.cl"
#include "common/quaternion.cl"

// Zeroth spherical harmonic, 1 / (2 sqrt(pi)), as far as the method gives it.
#define COLOR_SCALE ((REAL)0.2821)
// Slower to learn than the colour, so that it stays what all cameras share.
#define HARMONIC_SCALE ((REAL)0.1)

#define GAUSSIAN_OR_RETURN          \
  const int i = get_global_id(0);   \
  if (i >= count) return;           \
  const long texel = texels[i]

REAL4 changed_rotation(const REAL4 base, const REAL4 change, const REAL scale, REAL* inverse_norm) {
  const REAL4 sum = base + scale * change;
  *inverse_norm = 1 / sqrt(fmax(dot(sum, sum), (REAL)1e-12f));
  return sum * *inverse_norm;
}

kernel void assemble_forward(global const REAL* position_map, global const REAL* rotation_map,
                             global const REAL* color_map, global const int* texels, global const REAL* base_positions,
                             global const REAL* base_rotations, global const REAL* base_log_scales,
                             global REAL* positions, global REAL* rotations, global REAL* log_scales,
                             global REAL* opacities, global REAL* colors, global REAL* offsets,
                             global REAL* opacity_logits, const REAL offset_scale, const REAL rotation_scale,
                             const int count) {
  GAUSSIAN_OR_RETURN;
  const REAL3 offset = vload3(texel, position_map);
  vstore3(offset, i, offsets);
  vstore3(vload3(i, base_positions) + offset_scale * offset, i, positions);

  global const REAL* change = rotation_map + texel * 7;
  REAL inverse_norm;
  vstore4(changed_rotation(vload4(i, base_rotations), vload4(0, change), rotation_scale, &inverse_norm), i, rotations);
  vstore3(vload3(i, base_log_scales) + vload3(0, change + 4), i, log_scales);

  const REAL4 color = vload4(texel, color_map);
  opacities[i] = 1 / (1 + exp(-color.w));
  opacity_logits[i] = color.w;
  // Not fmax, which would turn a NaN into black.
  const REAL3 shade = (REAL)0.5f + COLOR_SCALE * color.xyz;
  vstore3(select(shade, (REAL3)(0), shade <= (REAL3)(0)), i, colors);
}

kernel void assemble_positions_backward(global const REAL* d_positions, global const REAL* d_offsets,
                                        global const int* texels, global REAL* d_position_map, const REAL offset_scale,
                                        const int count) {
  GAUSSIAN_OR_RETURN;
  vstore3(offset_scale * vload3(i, d_positions) + vload3(i, d_offsets), texel, d_position_map);
}

kernel void assemble_rotations_backward(global const REAL* d_rotations, global const REAL* d_log_scales,
                                        global const REAL* rotation_map, global const REAL* base_rotations,
                                        global const int* texels, global REAL* d_rotation_map,
                                        const REAL rotation_scale, const int count) {
  GAUSSIAN_OR_RETURN;
  REAL inverse_norm;
  const REAL4 unit = changed_rotation(vload4(i, base_rotations), vload4(0, rotation_map + texel * 7), rotation_scale,
                                      &inverse_norm);
  const REAL4 d = vload4(i, d_rotations);
  global REAL* change = d_rotation_map + texel * 7;
  vstore4(rotation_scale * inverse_norm * (d - dot(d, unit) * unit), 0, change);
  vstore3(vload3(i, d_log_scales), 0, change + 4);
}

// No gradient to a colour that the clamp holds at 0.
kernel void assemble_colors_backward(global const REAL* d_colors, global const REAL* d_opacities,
                                     global const REAL* d_opacity_logits, global const REAL* colors,
                                     global const REAL* opacities, global const int* texels, global REAL* d_color_map,
                                     const int count) {
  GAUSSIAN_OR_RETURN;
  const REAL3 color = vload3(i, colors), d = vload3(i, d_colors);
  const REAL opacity = opacities[i];
  vstore4((REAL4)(color.x > 0 ? COLOR_SCALE * d.x : 0, color.y > 0 ? COLOR_SCALE * d.y : 0,
                  color.z > 0 ? COLOR_SCALE * d.z : 0,
                  opacity * (1 - opacity) * d_opacities[i] + d_opacity_logits[i]),
          texel, d_color_map);
}

kernel void gather_harmonics(global const REAL* map, global const int* texels, global REAL* harmonics,
                             const int channels, const int count) {
  GAUSSIAN_OR_RETURN;
  for (int c = 0; c < channels; ++c) harmonics[(long)i * channels + c] = HARMONIC_SCALE * map[texel * channels + c];
}

kernel void gather_harmonics_backward(global const REAL* d_harmonics, global const int* texels, global REAL* d_map,
                                      const int channels, const int count) {
  GAUSSIAN_OR_RETURN;
  for (int c = 0; c < channels; ++c) d_map[texel * channels + c] = HARMONIC_SCALE * d_harmonics[(long)i * channels + c];
}
