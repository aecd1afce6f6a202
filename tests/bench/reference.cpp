#include "tests/bench/reference.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <numeric>
#include <ostream>
#include <stdexcept>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/reference.h"
#include "server/trace/sources.h"
#include "shaders/lib/as_cpp.h"
#include "tests/bench/errors.h"
#include "tests/bench/scene_hash.h"

namespace gonio::bench {
namespace {

// Part of the hash: raise it when the same scene gets other values, by a change of the passes or of the path tracer.
constexpr std::uint32_t kVersion = 4;

std::uint64_t content_hash(const Scene& scene, const ReferenceSettings& settings) {
    Hash h;
    h.add(kVersion);
    for (const double x : {settings.noise, settings.seconds}) h.add(x);
    for (const int x : {settings.cells, settings.rsm_size, scene.width_px, scene.height_px}) h.add(x);
    h.add(scene);
    return h.value;
}

// The file: this header, then receivers, then five arrays of doubles. Of this machine only, as a cache is.
struct Header {
    char magic[8] = {'g', 'o', 'n', 'i', 'o', 'r', 'e', 'f'};
    std::uint64_t hash = 0, receivers = 0, empty_pixels = 0;
};

static_assert(sizeof(Receiver) == 56);  // no padding

template <typename T>
void write(std::ostream& out, const std::vector<T>& values) {
    out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

template <typename T>
bool read(std::istream& in, std::vector<T>& values, std::size_t count) {
    values.resize(count);
    return static_cast<bool>(
        in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T))));
}

bool load(const std::filesystem::path& path, std::uint64_t hash, std::size_t most, Reference& reference) {
    std::ifstream in(path, std::ios::binary);
    Header header;
    const Header expected;
    if (!in.read(reinterpret_cast<char*>(&header), sizeof header)) return false;
    if (std::memcmp(header.magic, expected.magic, sizeof header.magic) != 0 || header.hash != hash) return false;
    const std::size_t n = header.receivers;
    if (n > most) return false;
    reference.empty_pixels = header.empty_pixels;
    reference.cached = read(in, reference.receivers, n) && read(in, reference.rsm_lx, n) &&
                       read(in, reference.truth_lx, n) && read(in, reference.truth_variance, n) &&
                       read(in, reference.all_lx, n) && read(in, reference.all_variance, n);
    return reference.cached;
}

void store(const std::filesystem::path& path, std::uint64_t hash, const Reference& reference) {
    const std::filesystem::path unfinished = path.string() + ".part";
    std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
    Header header;
    header.hash = hash;
    header.receivers = reference.receivers.size();
    header.empty_pixels = reference.empty_pixels;
    out.write(reinterpret_cast<const char*>(&header), sizeof header);
    write(out, reference.receivers);
    write(out, reference.rsm_lx);
    write(out, reference.truth_lx);
    write(out, reference.truth_variance);
    write(out, reference.all_lx);
    write(out, reference.all_variance);
    out.close();
    if (!out) throw std::runtime_error("cannot write " + unfinished.string());
    std::filesystem::rename(unfinished, path);
}

// Rounds of twice as many samples each, every one from its own seed, of those points that need them: the root of the
// mean variance over all points falls fastest for its cost where a point's samples are proportional to the deviation of
// one sample there. The estimates of it are the path tracer's own.
void trace_truth(const Scene& scene, int bounces, const ReferenceSettings& settings,
                 const std::vector<Receiver>& receivers, std::vector<double>& truth_lx,
                 std::vector<double>& truth_variance, std::ostream& progress) {
    constexpr std::uint32_t kFirstRound = 256;
    const auto world = trace::make_world(scene);
    const std::size_t n = receivers.size();
    struct Sum {
        double samples = 0.0, lx = 0.0, variance = 0.0;  // weighted by samples, by their square
    };
    std::vector<Sum> sums(n);
    std::vector<std::size_t> active(n);
    std::iota(active.begin(), active.end(), std::size_t{0});
    truth_lx.assign(n, 0.0);
    truth_variance.assign(n, 0.0);
    const auto begin = std::chrono::steady_clock::now();
    double traced = 0.0;
    trace::Settings wanted;
    wanted.bounces = bounces;
    wanted.noise = 0.0;
    wanted.max_passes = kFirstRound;
    while (!active.empty()) {
        std::vector<trace::MeterPoint> points;
        for (std::size_t i : active) points.push_back({receivers[i].position, receivers[i].normal});
        const std::vector<trace::Reading> readings = trace::measure(*world, points, wanted);
        for (std::size_t k = 0; k < active.size(); ++k) {
            const double samples = readings[k].samples;
            Sum& sum = sums[active[k]];
            sum.samples += samples;
            sum.lx += samples * glsl64::luminance(readings[k].indirect_lx);
            sum.variance += samples * samples * readings[k].indirect_error_lx * readings[k].indirect_error_lx;
            traced += samples;
        }
        double mean_lx = 0.0, mean_variance = 0.0, mean_deviation = 0.0;
        std::vector<double> deviation(n);  // of one sample
        for (std::size_t i = 0; i < n; ++i) {
            truth_lx[i] = sums[i].lx / sums[i].samples;
            truth_variance[i] = sums[i].variance / (sums[i].samples * sums[i].samples);
            deviation[i] = std::sqrt(truth_variance[i] * sums[i].samples);
            mean_lx += truth_lx[i] / static_cast<double>(n);
            mean_variance += truth_variance[i] / static_cast<double>(n);
            mean_deviation += deviation[i] / static_cast<double>(n);
        }
        const double goal_lx = settings.noise * mean_lx;
        const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        progress << "  truth of " << (bounces < 0 ? "all bounces: " : "one bounce: ") << active.size()
                 << " points more, " << static_cast<std::uint64_t>(traced / 1e3) << "k samples in all, noise "
                 << std::sqrt(mean_variance) / std::max(mean_lx, 1e-300) << ", " << spent_s << " s\n"
                 << std::flush;
        if (mean_variance <= goal_lx * goal_lx) return;
        // All that are still active have been in every round. One that a few lucky samples made look quiet gets a
        // quarter of the mean deviation, so that it is looked at again.
        wanted.max_passes = static_cast<std::uint32_t>(sums[active[0]].samples);
        ++wanted.seed;
        std::erase_if(active, [&](std::size_t i) {
            const double needed = std::max(deviation[i], 0.25 * mean_deviation) * mean_deviation / (goal_lx * goal_lx);
            return sums[i].samples >= 1.1 * needed;
        });
        const double round_s =
            spent_s / traced * static_cast<double>(active.size()) * static_cast<double>(wanted.max_passes);
        if (spent_s + round_s > settings.seconds || wanted.max_passes >= 1u << 30) return;
    }
}

// Result: whether another surface passes within a hundred-thousandth of the scene's extent of the point, along its own.
bool on_seam(const trace::Geometry& geometry, const Receiver& receiver) {
    const glm::vec3 normal(receiver.normal), p = geometry.local(receiver.position);
    const glm::vec3 off = p + normal * (4.0f * geometry.step_off(p));
    const glm::vec3 side =
        glm::normalize(glm::cross(normal, std::abs(normal.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0)));
    const float reach = 1e-5f * geometry.extent();
    constexpr int kDirections = 8;
    for (int i = 0; i < kDirections / 2; ++i) {
        const float angle = glm::radians(360.0f) * static_cast<float>(i) / kDirections;
        const glm::vec3 along = (side * std::cos(angle) + glm::cross(normal, side) * std::sin(angle)) * reach;
        if (geometry.occluded(off - along, off + along)) return true;
    }
    return false;
}

void leave_out_seams(const Scene& scene, Reference& reference) {
    const trace::Geometry geometry(scene.asset);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < reference.receivers.size(); ++i) {
        if (on_seam(geometry, reference.receivers[i])) continue;
        reference.receivers[kept] = reference.receivers[i];
        reference.rsm_lx[kept] = reference.rsm_lx[i];
        reference.truth_lx[kept] = reference.truth_lx[i];
        reference.truth_variance[kept] = reference.truth_variance[i];
        reference.all_lx[kept] = reference.all_lx[i];
        reference.all_variance[kept] = reference.all_variance[i];
        ++kept;
    }
    reference.seam_pixels = reference.receivers.size() - kept;
    reference.receivers.resize(kept);
    for (std::vector<double>* values : {&reference.rsm_lx, &reference.truth_lx, &reference.truth_variance,
                                        &reference.all_lx, &reference.all_variance})
        values->resize(kept);
}

}  // namespace

Reference reference_of(const Scene& scene, const ReferenceSettings& settings, const std::filesystem::path& cache,
                       std::ostream& progress) {
    const std::uint64_t hash = content_hash(scene, settings);
    char name[32];
    std::snprintf(name, sizeof name, "%016llx.ref", static_cast<unsigned long long>(hash));
    const std::filesystem::path path = cache / name;
    const auto pixels = stratified_pixels(scene.width_px, scene.height_px, settings.cells);
    Reference reference;
    if (!load(path, hash, pixels.size(), reference)) {
        std::filesystem::create_directories(cache);
        reference = {};
        reference.receivers = receivers_of(scene, pixels);
        reference.empty_pixels = pixels.size() - reference.receivers.size();
        progress << "  reference " << name << ": " << reference.receivers.size() << " points, dense sum of "
                 << scene.lights.size() << " luminaires\n"
                 << std::flush;
        reference.rsm_lx = dense_rsm_lx(scene, reference.receivers, settings.rsm_size);
        trace_truth(scene, 1, settings, reference.receivers, reference.truth_lx, reference.truth_variance, progress);
        trace_truth(scene, trace::kAllBounces, settings, reference.receivers, reference.all_lx, reference.all_variance,
                    progress);
        store(path, hash, reference);
    }
    leave_out_seams(scene, reference);
    return reference;
}

}  // namespace gonio::bench
