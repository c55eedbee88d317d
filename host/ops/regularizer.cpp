#include "host/ops/regularizer.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "host/ops/reduction.h"

namespace degas {
namespace {

Tensor row_lengths(Tape& tape, const Tensor& rows) {
  Device& device = tape.device();
  const int64_t count = rows.dim(0);
  const Range range{static_cast<size_t>(count)};
  const Tensor lengths(device, {count});
  device.kernel("regularizer", "row_lengths").launch(range, device.pointwise_local(), rows, lengths, count);
  tape.record("row_lengths", {rows}, {lengths}, [=](Tape& tape) {
    tape.accumulate(rows, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("regularizer", "row_lengths_gradient")
          .launch(range, device.pointwise_local(), rows, lengths, lengths.gradient(), gradient, count);
    });
  });
  return lengths;
}

}  // namespace

Tensor mean_length(Tape& tape, const Tensor& vectors) {
  if (vectors.shape().size() != 2 || vectors.dim(1) != 3) {
    throw std::logic_error(fmt::format("[mean_length] needs (N,3), got {}", to_string(vectors.shape())));
  }
  return mean(tape, row_lengths(tape, vectors));
}

Tensor excess_scale(Tape& tape, const Tensor& log_scales, const Tensor& base_log_scales, double limit) {
  const int64_t count = log_scales.size();
  if (count != base_log_scales.size()) {
    throw std::logic_error(fmt::format("[excess_scale] sizes differ: {} and {}", to_string(log_scales.shape()),
                                       to_string(base_log_scales.shape())));
  }
  Device& device = tape.device();
  const Tensor excess(device, log_scales.shape()), flags(device, log_scales.shape()), output(device, {1});
  device.kernel("regularizer", "scale_excess")
      .launch(device.pointwise_global(count), device.pointwise_local(), log_scales, base_log_scales, excess, flags,
              std::log(limit), count);
  Tape silent(device, false);
  const Tensor flag_count = sum(silent, flags);
  device.kernel("regularizer", "ratio").launch({1}, {1}, sum(silent, excess), flag_count, output);
  tape.record("excess_scale", {log_scales}, {output}, [=](Tape& tape) {
    tape.accumulate(log_scales, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("regularizer", "scale_excess_gradient")
          .launch(device.pointwise_global(count), device.pointwise_local(), excess, flag_count, output.gradient(),
                  gradient, count);
    });
  });
  return output;
}

Tensor mean_shortfall(Tape& tape, const Tensor& values, double least, const Tensor& base) {
  Device& device = tape.device();
  const int64_t count = values.size();
  if (base.defined() && base.size() != count) {
    throw std::logic_error(
        fmt::format("[mean_shortfall] sizes differ: {} and {}", to_string(values.shape()), to_string(base.shape())));
  }
  const Tensor shortfalls(device, values.shape());
  device.kernel("regularizer", "shortfall")
      .launch(device.pointwise_global(count), device.pointwise_local(), values, base, shortfalls, least, count);
  tape.record("shortfall", {values}, {shortfalls}, [=](Tape& tape) {
    tape.accumulate(values, [&](const Tensor& gradient) {
      Device& device = tape.device();
      device.kernel("regularizer", "shortfall_gradient")
          .launch(device.pointwise_global(count), device.pointwise_local(), values, base, shortfalls.gradient(),
                  gradient, least, count);
    });
  });
  return mean(tape, shortfalls);
}

Tensor gate(Tape& tape, const Tensor& value, const Tensor& control, double limit) {
  if (value.size() != 1 || control.size() != 1) throw std::logic_error("[gate] needs one value and one control");
  Device& device = tape.device();
  const Tensor output(device, {1});
  device.kernel("regularizer", "gate").launch({1}, {1}, value, control, output, limit);
  tape.record("gate", {value}, {output}, [=](Tape& tape) {
    tape.accumulate(value, [&](const Tensor& gradient) {
      tape.device().kernel("regularizer", "gate").launch({1}, {1}, output.gradient(), control, gradient, limit);
    });
  });
  return output;
}

}  // namespace degas
