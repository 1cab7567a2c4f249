// Times Eigen on the problem that benches/relight.rs writes: eigen FOLDER RUNS
//
// Prints {name: milliseconds a frame of three channels} on one thread and on all cores. Leaves the
// pictures in FOLDER.
#include <omp.h>

#include <Eigen/Sparse>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

using Matrix = Eigen::SparseMatrix<float, Eigen::RowMajor, int>;

template <typename T>
std::vector<T> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  std::vector<T> values(static_cast<size_t>(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), values.size() * sizeof(T));
  return values;
}

int main(int, char** arguments) {
  const std::string folder = std::string(arguments[1]) + "/";
  const int runs = std::stoi(arguments[2]);
  const auto begins = read<int>(folder + "begins.i32");
  const auto indices = read<int>(folder + "indices.i32");
  std::vector<float> values[3];
  std::vector<Eigen::Map<const Matrix>> matrices;
  Eigen::VectorXf lights[3];
  const auto rows = static_cast<int>(begins.size()) - 1;
  for (int c = 0; c < 3; c++) {
    const auto channel = std::to_string(c) + ".f32";
    const auto light = read<float>(folder + "light" + channel);
    values[c] = read<float>(folder + "values" + channel);
    lights[c] = Eigen::Map<const Eigen::VectorXf>(light.data(), light.size());
    matrices.emplace_back(rows, light.size(), indices.size(), begins.data(), indices.data(),
                          values[c].data());
  }
  Eigen::MatrixXf picture(rows, 3);
  const auto time = [&](const std::string& name, int threads) {
    using Clock = std::chrono::steady_clock;
    Eigen::setNbThreads(threads);
    picture.setZero();
    double best = std::numeric_limits<double>::infinity();
    for (int run = 0; run < runs; run++) {
      const auto start = Clock::now();
      for (int c = 0; c < 3; c++) picture.col(c).noalias() = matrices[c] * lights[c];
      const std::chrono::duration<double, std::milli> taken = Clock::now() - start;
      best = std::min(best, taken.count());
    }
    std::ofstream file(folder + name + ".f32", std::ios::binary);
    file.exceptions(std::ios::failbit | std::ios::badbit);
    file.write(reinterpret_cast<const char*>(picture.data()), picture.size() * sizeof(float));
    return best;
  };
  const double one = time("eigen_1_thread", 1), all = time("eigen", omp_get_max_threads());
  std::printf("{\"eigen_1_thread\": %f, \"eigen\": %f}\n", one, all);
}
