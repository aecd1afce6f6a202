#include "tests/bench/machine.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/stream/encoder.h"
#include "server/transport/table.h"
#include "tests/bench/cases.h"
#include "tests/bench/frame_loop.h"

namespace gonio::bench {
namespace {

// Sixteen floats; compilers lower them to what the machine has.
// NOLINTNEXTLINE(modernize-use-using): GCC takes the attribute of a using for another type's
typedef float Vector __attribute__((vector_size(64)));

constexpr int kChains = 8;  // as many as hide a multiply-add's latency
#if defined(__x86_64__)
__attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#endif
float multiply_adds(int rounds) {
    Vector a{}, b{}, c{}, d{}, e{}, f{}, g{}, h{};
    Vector factor{}, term{};
    for (int i = 0; i < 16; ++i) factor[i] = 0.999f, term[i] = 0.001f * static_cast<float>(i);
    for (int i = 0; i < rounds; ++i) {
        a = a * factor + term, b = b * factor + term, c = c * factor + term, d = d * factor + term;
        e = e * factor + term, f = f * factor + term, g = g * factor + term, h = h * factor + term;
    }
    const Vector sum = ((a + b) + (c + d)) + ((e + f) + (g + h));
    return sum[3];
}

// Result: seconds that the work took on all threads at once, the best of several runs.
double best_s(unsigned threads, const std::function<void(unsigned)>& work) {
    double best = 1e30;
    for (int run = 0; run < 5; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        {
            std::vector<std::jthread> all;
            for (unsigned i = 0; i < threads; ++i) all.emplace_back([&work, i] { work(i); });
        }
        best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return best;
}

// Pictures as `gonio-bench frames` encodes them: everything lit anew in each.
double encoder_ms(const gl::Context& context) {
    constexpr int kPictures = 40;
    Renderer renderer(context);
    Scene scene = scene_of(bench_asset("cornell"));
    const auto home = positions_of(scene);
    auto encoder = H264Encoder::open(scene.width_px, scene.height_px);
    if (!encoder) throw std::runtime_error(encoder.error().text());
    std::vector<double> times_ms;
    for (int n = 0; n < kPictures; ++n) {
        wander(scene, home, n);
        renderer.begin_frame(scene, monotonic_ns());
        const FinishedFrame done = *renderer.finish_frame(true);
        const Picture picture{done.report.scene_rev(), done.width_px,   done.height_px, done.nv12,
                              done.drained_ns,         done.rendered_ns};
        const auto frame = (*encoder)->encode(picture, n == 0);
        if (!frame) throw std::runtime_error(frame.error().text());
        if (n > 0) times_ms.push_back(static_cast<double>(frame->encoded_ns - frame->began_ns) * 1e-6);
    }
    return median(std::move(times_ms));
}

}  // namespace

MachineRates measure_machine(const gl::Context& context) {
    MachineRates rates;
    rates.threads = std::max(1u, std::thread::hardware_concurrency());
    const double threads = rates.threads;
    std::vector<float> kept(rates.threads);

    constexpr int kRounds = 4'000'000;
    rates.flops_per_s = threads * kRounds * kChains * 16.0 * 2.0 /
                        best_s(rates.threads, [&](unsigned i) { kept[i] = multiply_adds(kRounds); });

    constexpr std::size_t kFloats = std::size_t{1} << 23;
    std::vector<std::vector<float>> arrays(std::size_t{3} * rates.threads, std::vector<float>(kFloats, 1.0f));
    rates.bytes_per_s = threads * kFloats * 12.0 / best_s(rates.threads, [&](unsigned i) {
                            float* a = arrays[3 * i].data();
                            const float *b = arrays[3 * i + 1].data(), *c = arrays[3 * i + 2].data();
                            for (std::size_t k = 0; k < kFloats; ++k) a[k] = b[k] + 0.5f * c[k];
                        });

    // A bounce among so many surfels.
    constexpr std::size_t kSurfels = 32'768;
    constexpr unsigned kLinks = 512;
    Pool pool;
    transport::Table table;
    transport::make_table(std::vector<glm::vec4>(kSurfels, glm::vec4(1.0f)), table, pool);
    std::vector<std::uint16_t> ids(kSurfels * kLinks);
    std::mt19937 random;
    for (std::uint16_t& id : ids) id = static_cast<std::uint16_t>(random() % kSurfels);
    std::vector<glm::vec4> sums(kSurfels);
    rates.links_per_s = static_cast<double>(ids.size()) / best_s(1, [&](unsigned) {
                            pool.run_chunks(kSurfels, 256, [&](std::size_t first, std::size_t count) {
                                transport::gather(table, {ids.data() + first * kLinks, kLinks, kLinks, count}, 1.0f,
                                                  sums.data() + first);
                            });
                        });
    for (const char* scene : {"cornell", "atrium"}) rates.rays.push_back(measure_rays(scene));
    rates.encoder_ms = encoder_ms(context);
    return rates;
}

void print_machine(const MachineRates& rates, bool json, std::ostream& out) {
    if (json) {
        nlohmann::ordered_json all = {{"threads", rates.threads},
                                      {"flops_per_s", rates.flops_per_s},
                                      {"bytes_per_s", rates.bytes_per_s},
                                      {"links_per_s", rates.links_per_s},
                                      {"encoder_ms", rates.encoder_ms}};
        for (const RayRates& rays : rates.rays) {
            all["rays"].push_back(
                {{"scene", rays.scene}, {"shadow_per_s", rays.shadow_per_s}, {"link_per_s", rays.link_per_s}});
        }
        out << all.dump(2) << "\n";
        return;
    }
    out << rates.threads << " threads: " << rates.flops_per_s * 1e-9 << " Gflop/s, " << rates.bytes_per_s * 1e-9
        << " GB/s, " << rates.links_per_s * 1e-9 << " G links/s; " << rates.encoder_ms << " ms a frame encoded\n";
    for (const RayRates& rays : rates.rays) {
        out << rays.scene << ", M rays/s: " << rays.shadow_per_s * 1e-6 << " to the luminaire, "
            << rays.link_per_s * 1e-6 << " of links\n";
    }
}

}  // namespace gonio::bench
