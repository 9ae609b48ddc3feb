// Volumes made by formula, for tests: any size, any range, seeded.
#pragma once

#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "common/patch/visit_samples.h"
#include "common/patch/volume.h"

namespace intervale::testing {

template <class T>
Volume volume_of_type(SampleType type, const std::array<std::int32_t, 3>& dims, const std::vector<T>& samples) {
  Volume v;
  v.name = "made";
  v.grid.dims = dims;
  v.type = type;
  const auto bytes = std::as_bytes(std::span(samples));
  v.bytes.assign(bytes.begin(), bytes.end());
  return v;
}

// A gyroid of about two periods, in [-1.5, 1.5].
inline Volume gyroid(const std::array<std::int32_t, 3>& dims) {
  std::vector<float> f;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) {
        const double a = x * 0.7, b = y * 0.7, c = z * 0.7;
        f.push_back(float(std::sin(a) * std::cos(b) + std::sin(b) * std::cos(c) + std::sin(c) * std::cos(a)));
      }
    }
  }
  return volume_of_type(SampleType::f32, dims, f);
}

// Integers from 0 to 9: many samples equal to each other and to bounds.
inline Volume digits(const std::array<std::int32_t, 3>& dims, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> f(std::size_t(dims[0]) * dims[1] * dims[2]);
  for (auto& v : f) v = std::uint8_t(random() % 10);
  return volume_of_type(SampleType::u8, dims, f);
}

// A wall, z < 4, and single samples that stand out far from it.
inline Volume specks(const std::array<std::int32_t, 3>& dims, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> f(std::size_t(dims[0]) * dims[1] * dims[2], 0);
  std::fill_n(f.begin(), 4 * std::size_t(dims[0]) * dims[1], std::uint8_t(10));
  const auto within = [&random](std::int32_t from, std::int32_t to) { return from + std::int32_t(random() % unsigned(to - from)); };
  for (int k = 0; k < 8; ++k) {
    const std::int32_t x = within(1, dims[0] - 1), y = within(1, dims[1] - 1), z = within(2 * dims[2] / 3, dims[2] - 1);
    f[std::size_t(x) + std::size_t(dims[0]) * (std::size_t(y) + std::size_t(dims[1]) * std::size_t(z))] = 10;
  }
  return volume_of_type(SampleType::u8, dims, f);
}

// A smooth bump and a little noise, in steps of 2^-12: some regions full, some empty.
inline Volume bump(const std::array<std::int32_t, 3>& dims, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-2, 2), place(0.2, 0.8);
  const double cx = place(random) * dims[0], cy = place(random) * dims[1], cz = place(random) * dims[2];
  std::vector<double> f;
  for (int z = 0; z < dims[2]; ++z) {
    for (int y = 0; y < dims[1]; ++y) {
      for (int x = 0; x < dims[0]; ++x) f.push_back(std::round(0x1p12 * (100 - 6 * std::hypot(x - cx, y - cy, z - cz) + noise(random))) / 0x1p12);
    }
  }
  return volume_of_type(SampleType::f64, dims, f);
}

// The sample at integer coordinates.
inline double sample(const Volume& v, int x, int y, int z) {
  return visit_samples(v, [&](auto samples) { return double(samples[(std::size_t(z) * v.grid.dims[1] + y) * v.grid.dims[0] + x]); });
}

}  // namespace intervale::testing
