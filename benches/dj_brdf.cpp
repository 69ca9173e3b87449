// Nanoseconds of one evaluation of dj_brdf's SGD, as benches/brdf.rs measures ours: gold-paint, 512
// pairs of directions even over the hemisphere, the fastest of many runs over all of them.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <vector>

#define DJ_BRDF_IMPLEMENTATION 1
#include "dj_brdf.h"

// The result is a vector or an array of numbers, by the header's version.
static double first(const djb::vec3 &value) { return value.x; }
template <typename Values> static double first(const Values &values) { return values[0]; }

static djb::vec3 direction(std::mt19937 &generator) {
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const double cos_theta = uniform(generator), phi = 2.0 * M_PI * uniform(generator);
    const double sin_theta = std::sqrt(1.0 - cos_theta * cos_theta);
    return djb::vec3(sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta);
}

int main() {
    constexpr int pairs = 512, runs = 2000;
    std::mt19937 generator(1);
    std::vector<djb::vec3> wi, wo;
    for (int i = 0; i < pairs; ++i) {
        wi.push_back(direction(generator));
        wo.push_back(direction(generator));
    }
    const djb::sgd material("gold-paint");
    double fastest = HUGE_VAL, sum = 0.0;
    for (int run = 0; run < runs; ++run) {
        const auto start = std::chrono::steady_clock::now();
        for (int i = 0; i < pairs; ++i) sum += first(material.eval(wi[i], wo[i]));
        const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
        fastest = std::min(fastest, taken.count() / pairs);
    }
    // The sum is looked at, so no evaluation can be left out.
    if (!std::isfinite(sum)) return 1;
    std::printf("%.4g\n", fastest);
}
