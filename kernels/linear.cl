// Fully connected layer for few rows: output = leaky_relu(input W + bias), forward and backward. Batches are small
// (usually 1), so every kernel reads or writes the weights once and their bandwidth is the limit.
// Layouts: input (N, In), W (In, Out), output (N, Out), bias (Out) or none (null).
// -D UNROLL: vectors of V outputs that an item of linear_partial owns.
// Deterministic: partial sums over blocks of inputs are added in order.
#include "common/real.cl"

// partial[block, n, o] = sum of input[n, i] * W[i, o] over the block_size inputs of the block.
// Launch: (ceil(Out / (V * UNROLL)), blocks, N).
kernel void linear_partial(global const REAL* input, global const REAL* weight, global REAL* partial, const int inputs,
                           const int outputs, const int block_size, const int batch) {
  const int first = (int)get_global_id(0) * V * UNROLL;
  const int block = get_global_id(1), n = get_global_id(2);
  const int begin = block * block_size, end = min(begin + block_size, inputs);
  if (first >= outputs || begin >= inputs || n >= batch) return;
  global const REAL* x = input + (long)n * inputs;
  global REAL* target = partial + ((long)block * batch + n) * outputs + first;
  if (first + V * UNROLL <= outputs) {
    REALV sums[UNROLL];
#pragma unroll
    for (int u = 0; u < UNROLL; ++u) sums[u] = 0;
    for (int i = begin; i < end; ++i) {
      const REALV value = (REALV)(x[i]);
      global const REAL* row = weight + (long)i * outputs + first;
#pragma unroll
      for (int u = 0; u < UNROLL; ++u) sums[u] += value * LOAD_VECTOR(u, row);
    }
#pragma unroll
    for (int u = 0; u < UNROLL; ++u) STORE_VECTOR(sums[u], u, target);
  } else {
    for (int o = 0; first + o < outputs; ++o) {
      REAL sum = 0;
      for (int i = begin; i < end; ++i) sum += x[i] * weight[(long)i * outputs + first + o];
      target[o] = sum;
    }
  }
}

// output = leaky_relu(sum of the blocks + bias). Launch: one item per output of the batch.
kernel void linear_finish(global const REAL* partial, global const REAL* bias, global REAL* output, const int blocks,
                          const int outputs, const int batch, const REAL slope) {
  const int i = get_global_id(0);
  if (i >= outputs * batch) return;
  REAL sum = bias ? bias[i % outputs] : 0;
  for (int block = 0; block < blocks; ++block) sum += partial[(long)block * batch * outputs + i];
  output[i] = sum > 0 ? sum : slope * sum;
}

// Gradient before the leaky ReLU, whose output has its input's sign (slope 0: no gradient at or below 0).
// Launch: one item per output of the batch.
kernel void linear_activation_backward(global const REAL* output, global const REAL* gradient, global REAL* before,
                                       const REAL slope, const int count) {
  const int i = get_global_id(0);
  if (i >= count) return;
  before[i] = output[i] > 0 ? gradient[i] : slope * gradient[i];
}

// dbias[o] = sum over n of before[n, o]. Launch: one item per output.
kernel void linear_bias_backward(global const REAL* before, global REAL* gradient, const int outputs, const int batch) {
  const int o = get_global_id(0);
  if (o >= outputs) return;
  REAL sum = 0;
  for (int n = 0; n < batch; ++n) sum += before[(long)n * outputs + o];
  gradient[o] = sum;
}

// dW[i, o] = sum over n of input[n, i] * before[n, o]. Launch: (ceil(Out / V), In).
kernel void linear_weight_backward(global const REAL* input, global const REAL* before, global REAL* gradient,
                                   const int inputs, const int outputs, const int batch) {
  const int first = (int)get_global_id(0) * V;
  const int i = get_global_id(1);
  if (first >= outputs || i >= inputs) return;
  global REAL* target = gradient + (long)i * outputs + first;
  if (first + V <= outputs) {
    REALV sums = 0;
    for (int n = 0; n < batch; ++n) {
      sums += input[(long)n * inputs + i] * LOAD_VECTOR(0, before + (long)n * outputs + first);
    }
    STORE_VECTOR(sums, 0, target);
  } else {
    for (int o = 0; first + o < outputs; ++o) {
      REAL sum = 0;
      for (int n = 0; n < batch; ++n) sum += input[(long)n * inputs + i] * before[(long)n * outputs + first + o];
      target[o] = sum;
    }
  }
}

// dinput[n, i] = sum over o of W[i, o] * before[n, o].
#if WIDE
// Launch: (In, N), one item per row of W.
kernel void linear_input_backward(global const REAL* weight, global const REAL* before, global REAL* gradient,
                                  const int inputs, const int outputs, const int batch) {
  const int i = get_global_id(0), n = get_global_id(1);
  if (i >= inputs || n >= batch) return;
  global const REAL* row = weight + (long)i * outputs;
  global const REAL* d = before + (long)n * outputs;
  REALV sums = 0;
  int o = 0;
  for (; o + V <= outputs; o += V) sums += LOAD_VECTOR(0, row + o) * LOAD_VECTOR(0, d + o);
  REAL lanes[V];
  STORE_VECTOR(sums, 0, lanes);
  REAL sum = 0;
  for (int lane = 0; lane < V; ++lane) sum += lanes[lane];
  for (; o < outputs; ++o) sum += row[o] * d[o];
  gradient[(long)n * inputs + i] = sum;
}
#else
// Launch: (64 * In, N), local (64, 1): a work-group per row of W, so that neighbouring items read neighbouring weights.
#define GROUP 64
kernel void linear_input_backward(global const REAL* weight, global const REAL* before, global REAL* gradient,
                                  const int inputs, const int outputs, const int batch) {
  local REAL sums[GROUP];
  const int lane = get_local_id(0), i = get_group_id(0), n = get_global_id(1);
  REAL sum = 0;
  for (int o = lane; o < outputs; o += GROUP) sum += weight[(long)i * outputs + o] * before[(long)n * outputs + o];
  sums[lane] = sum;
  barrier(CLK_LOCAL_MEM_FENCE);
  for (int reach = GROUP / 2; reach > 0; reach /= 2) {
    if (lane < reach) sums[lane] += sums[lane + reach];
    barrier(CLK_LOCAL_MEM_FENCE);
  }
  if (lane == 0) gradient[(long)n * inputs + i] = sums[0];
}
#endif
