#include "server/trace/reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/base/clock.h"
#include "server/scene/eye.h"
#include "server/scene/scene.h"
#include "server/trace/bodies.h"
#include "server/trace/cylinder.h"
#include "server/trace/denoise.h"
#include "server/trace/haze_path.h"
#include "server/trace/luminous.h"
#include "server/trace/parallel.h"
#include "server/trace/path.h"

namespace gonio::trace {
namespace {

// Independent randomisations of the same estimate: their spread is the error estimate, which samples of one
// low-discrepancy stream cannot give.
constexpr int kMeterStreams = 16, kPixelStreams = kLeastPassesOfNoise;
// Stopping rules aim below the asked noise, because the estimate is itself uncertain by 1/sqrt(2·15), about 18 %.
constexpr double kSafety = 0.8;
// Samples after which a point, and a picture, that nothing has reached is called dark.
constexpr std::uint32_t kDarkSamples = 1u << 16, kDarkPasses = 256;

// A sample that is not finite counts as dark: in a mean it would stay for ever.
bool is_finite(const glm::vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

struct Stream {
    glm::dvec3 direct{0.0}, indirect{0.0};  // sums, lux
};

// A point of a meter, as far as it is.
struct Measured {
    Receiver receiver;
    glm::dvec3 exact{0.0};  // direct light that needs no sampling, lux
    Stream streams[kMeterStreams];
    std::uint32_t samples = 0;  // of each stream
    bool done = false, noise_reached = false;
};

Reading reading_of(const Measured& point) {
    Reading reading;
    reading.direct_lx = point.exact;
    reading.samples = point.samples * kMeterStreams;
    reading.noise_reached = point.noise_reached;
    if (point.samples == 0) return reading;
    double direct2 = 0.0, indirect2 = 0.0;
    glm::dvec3 direct(0.0), indirect(0.0);
    for (const Stream& stream : point.streams) {
        direct += stream.direct / (kMeterStreams * static_cast<double>(point.samples));
        indirect += stream.indirect / (kMeterStreams * static_cast<double>(point.samples));
    }
    for (const Stream& stream : point.streams) {
        const double d = luminance(stream.direct / static_cast<double>(point.samples) - direct);
        const double e = luminance(stream.indirect / static_cast<double>(point.samples) - indirect);
        direct2 += d * d, indirect2 += e * e;
    }
    constexpr double kPairs = kMeterStreams * (kMeterStreams - 1);
    reading.direct_lx += direct;
    reading.indirect_lx = indirect;
    reading.direct_error_lx = std::sqrt(direct2 / kPairs);
    reading.indirect_error_lx = std::sqrt(indirect2 / kPairs);
    return reading;
}

}  // namespace

std::shared_ptr<const World> make_world(const Scene& scene, const World* previous) {
    auto world = std::make_shared<World>();
    if (previous != nullptr && &previous->geometry->asset() == scene.asset.get()) {
        world->geometry = previous->geometry;
        world->emitters = previous->emitters;
    } else {
        world->geometry = geometry_of(scene);
    }
    world->bodies = body_places(scene);
    if (scene.emission_hidden)
        world->emitters = no_emitters(world->geometry->asset());
    else if (world->emitters.empty())
        world->emitters = emitters_of(*world->geometry);
    world->luminaires = luminaires_of(scene, *world->geometry);
    world->haze = haze_of(scene, world->geometry->origin());
    world->running.push_back(0.0);
    for (const Luminaire& luminaire : world->luminaires)
        world->running.push_back(world->running.back() + static_cast<double>(luminaire.power));
    return world;
}

// One loop of rounds: cut up it would pass points, units and sums around.
std::vector<Reading> measure(const World& world, std::span<const MeterPoint> points, const Settings& settings,
                             std::stop_token stop) {
    const bool needs_paths = settings.bounces != 0 || !world.emitters.empty(), exact = world.all_points();
    std::vector<Measured> all(points.size());
    parallel(static_cast<int>(all.size()), settings.threads, settings.idle, stop, [&](int i) {
        Measured& point = all[static_cast<std::size_t>(i)];
        const MeterPoint& meter = points[static_cast<std::size_t>(i)];
        const glm::vec3 normal(meter.normal);
        point.receiver = receiver_of(*world.geometry, {world.geometry->local(meter.position), normal, normal});
        if (exact)
            point.exact = meter.by == Receives::plane ? glm::dvec3(luminaires_direct(world, point.receiver, nullptr))
                                                      : cylinder_direct(world, meter);
        point.done = point.noise_reached = !needs_paths && exact;
    });
    const std::int64_t begin_ns = monotonic_ns();
    const auto late = [&] { return settings.max_seconds > 0.0 && seconds_since(begin_ns) >= settings.max_seconds; };

    // Rounds of 64, 64, 128, 256, … samples a stream, until every point has the noise that was asked for.
    std::vector<int> units;
    std::vector<Stream> sums;
    while (!stop.stop_requested()) {
        units.clear();
        std::uint32_t reached = 0;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (all[i].done) continue;
            reached = all[i].samples;
            for (int s = 0; s < kMeterStreams; ++s) units.push_back(static_cast<int>(i) * kMeterStreams + s);
        }
        if (units.empty()) break;
        const std::uint32_t greatest = std::max(1u, settings.max_passes / kMeterStreams);
        const std::uint32_t round = std::min(std::max(reached, 64u), greatest - std::min(reached, greatest - 1));
        sums.assign(units.size(), {});
        std::atomic<bool> cut = false;
        const bool whole =
            parallel(static_cast<int>(units.size()), settings.threads, settings.idle, stop, [&](int unit) {
                if (reached > 0 && late()) cut = true;
                if (cut) return;
                const std::size_t i = static_cast<std::size_t>(units[static_cast<std::size_t>(unit)] / kMeterStreams);
                const int s = units[static_cast<std::size_t>(unit)] % kMeterStreams;
                const Measured& point = all[i];
                const MeterPoint& meter = points[i];
                Stream& sum = sums[static_cast<std::size_t>(unit)];
                const std::uint32_t seed =
                    mix_bits(mix_bits(settings.seed, static_cast<std::uint32_t>(i)), static_cast<std::uint32_t>(s));
                for (std::uint32_t n = 0; n < round; ++n) {
                    Sample sample(seed, point.samples + n);
                    Receiver receiver = point.receiver;
                    if (meter.by != Receives::plane) {  // the mean over its azimuths, one at a time
                        const glm::vec3 facing(upright_normal(meter, static_cast<double>(sample.next().x)));
                        receiver = receiver_of(*world.geometry, {point.receiver.position, facing, facing});
                    }
                    if (!exact) sum.direct += glm::dvec3(luminaires_direct(world, receiver, &sample));
                    if (needs_paths) {
                        const PathLight light =
                            (world.haze ? trace_path_in_haze : trace_path)(world, receiver, settings.bounces, sample);
                        if (!is_finite(light.direct) || !is_finite(light.indirect)) continue;
                        sum.direct += glm::dvec3(light.direct);
                        sum.indirect += glm::dvec3(light.indirect);
                    }
                }
            });
        if (!whole || cut) break;  // the last whole round stands
        for (std::size_t unit = 0; unit < units.size(); ++unit) {
            Stream& stream =
                all[static_cast<std::size_t>(units[unit] / kMeterStreams)].streams[units[unit] % kMeterStreams];
            stream.direct += sums[unit].direct;
            stream.indirect += sums[unit].indirect;
        }
        for (Measured& point : all) {
            if (point.done) continue;
            point.samples += round;
            const Reading reading = reading_of(point);
            const double total = luminance(reading.direct_lx + reading.indirect_lx);
            const double error = std::hypot(reading.direct_error_lx, reading.indirect_error_lx);
            // Nothing found is no proof of darkness: a far hole is met by one path in thousands. Of light after bounces
            // too, however bright the direct light is.
            const bool dark =
                needs_paths && settings.bounces != 0 ? !(luminance(reading.indirect_lx) > 0.0) : !(total > 0.0);
            const bool enough =
                (!dark || point.samples >= kDarkSamples / kMeterStreams) && error <= kSafety * settings.noise * total;
            point.noise_reached = enough;
            point.done = enough || point.samples >= greatest;
        }
    }
    std::vector<Reading> readings;
    for (const Measured& point : all) readings.push_back(reading_of(point));
    return readings;
}

struct Picture::Data {
    std::shared_ptr<const World> world;
    std::shared_ptr<const BodyGeometry> bodies;  // null: there are none
    PictureRequest request;
    Settings settings;
    Eye eye;
    struct Pixel {
        Receiver receiver;
        glm::vec3 albedo{0.0f}, emission{0.0f};
        glm::vec3 opening{0.0f};                             // of emission, what luminaires' openings are seen with
        glm::vec3 direct{0.0f};                              // exact, lux
        float inverse_depth = 0.0f;                          // 1/m
        bool hit = false;                                    // a surface, or
        bool shines = false;                                 // an opening alone
        glm::vec3 along{0.0f};                               // of its ray, unit
        float far = std::numeric_limits<float>::infinity();  // how far it goes, m
        float passed = 1.0f;                                 // of what is behind the haze
    };
    // Sums over a pixel's samples, of a request for planes.
    struct Sums {
        glm::vec3 half[2] = {glm::vec3(0.0f), glm::vec3(0.0f)}, exact{0.0f}, albedo{0.0f}, normal{0.0f};
        float depth = 0.0f, depth_squared = 0.0f;
    };
    std::vector<Pixel> first;     // without antialiasing: what each pixel shows
    std::vector<glm::dvec3> sum;  // per pixel, the quantity
    std::vector<glm::vec3> air;   // of it, what haze scatters to the eye; empty: there is none
    std::vector<Sums> planes;
    // Per pixel kPixelStreams sums of its luminance, less the openings that it shows: their edges are so bright that
    // the noise would be theirs alone.
    std::vector<float> streams;
    std::vector<std::uint32_t> hits;  // samples that met a surface
    std::vector<std::uint32_t> row_passes;
    bool points = true;  // so are all luminaires
    bool exact = false;  // one pass is the whole truth
    Progress progress;
    std::uint32_t next_check = kPixelStreams, last_check = 0;
    double seconds = 0.0;       // of refine() so far
    double pass_seconds = 0.0;  // of each of the latest passes

    // dice: of the surfaces that the ray passes.
    Pixel look(double x, double y, std::uint32_t dice) const {
        const glm::vec3 direction(
            glm::normalize(ray_through(eye, x / request.width_px * 2.0 - 1.0, 1.0 - y / request.height_px * 2.0)));
        Pixel pixel;
        SeenHit hit;
        pixel.hit =
            closest_seen(*world->geometry, bodies.get(), world->geometry->local(eye.position), direction, hit, dice);
        pixel.along = direction;
        if (hazy() && pixel.hit) {
            pixel.far = hit.distance;
            pixel.passed = static_cast<float>(
                transmittance(world->haze, glm::dvec3(world->geometry->local(eye.position)), glm::dvec3(hit.position)));
        }
        // Light of an opening comes from within its own body, which does not hide it.
        const glm::vec3 seen = openings_at(direction, std::min(static_cast<double>(hit.surface_m), 1e30));
        pixel.shines = !pixel.hit && seen != glm::vec3(0.0f);
        pixel.opening = seen;
        if (!pixel.hit) {
            pixel.emission = seen;
            return pixel;
        }
        pixel.receiver = receiver_of(*world->geometry, hit);
        pixel.albedo = hit.albedo * hit.tint;
        if (!world->emitters.empty()) pixel.emission = hit.emission * hit.tint;
        pixel.opening = seen * hit.tint;
        pixel.emission += pixel.opening;
        if (request.planes) pixel.inverse_depth = inverse_depth(hit);
        if (shows_direct() && points) pixel.direct = luminaires_direct(*world, pixel.receiver, nullptr);
        return pixel;
    }
    // Result: the luminance of luminaires' openings along a ray to what it meets, rgb, cd/m². What is behind one is
    // seen as well. One on a surface, or let into it by less than a millimetre or two, is before it.
    glm::vec3 openings_at(const glm::vec3& direction, double met_m) const {
        glm::vec3 seen(0.0f);
        if (points || !request.openings || request.quantity != Quantity::radiance) return seen;
        const glm::dvec3 from(world->geometry->local(eye.position));
        for (const Luminaire& luminaire : world->luminaires) {
            const auto shining = shining_at(luminaire, from, glm::dvec3(direction));
            if (shining && shining->distance_m * (1.0 - kShiningSlack) - kShiningSlack_m <= met_m)
                seen += luminaire.weight * static_cast<float>(shining->nit);
        }
        return seen;
    }
    float inverse_depth(const SurfaceHit& hit) const {
        const glm::dvec3 from_eye = glm::dvec3(hit.position) - glm::dvec3(world->geometry->local(eye.position));
        return static_cast<float>(1.0 / std::max(glm::dot(from_eye, eye.forward), 1e-6));
    }
    std::uint32_t dice(Sample& sample) const {
        return world->geometry->transmissive()
                   ? static_cast<std::uint32_t>(sample.next().x * static_cast<float>(Geometry::kDice))
                   : 0u;
    }
    bool shows_direct() const {
        return request.quantity != Quantity::irradiance_indirect && request.quantity != Quantity::radiance_indirect;
    }
    bool shows_indirect() const {
        return request.quantity != Quantity::irradiance_direct && request.quantity != Quantity::radiance_direct;
    }
    // Whether it shows what is between the eye and the surfaces.
    bool hazy() const { return world->haze && request.quantity == Quantity::radiance; }
    bool needs_paths() const {
        return hazy() || (shows_indirect() && settings.bounces != 0) || (shows_direct() && !world->emitters.empty());
    }

    void add_pass(int x, int y, std::uint32_t pass) {
        const std::size_t at =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(request.width_px) + static_cast<std::size_t>(x);
        const std::uint32_t stream = pass % kPixelStreams;
        Sample sample(mix_bits(mix_bits(settings.seed, static_cast<std::uint32_t>(at)), stream), pass / kPixelStreams);
        Pixel pixel;
        if (request.antialias) {
            const glm::vec2 jitter = sample.next();
            pixel = look(x + static_cast<double>(jitter.x), y + static_cast<double>(jitter.y), dice(sample));
        } else {
            if (pass == 0 || world->geometry->transmissive()) first[at] = look(x + 0.5, y + 0.5, dice(sample));
            pixel = first[at];
        }
        if (!pixel.hit && !pixel.shines && !hazy()) return;
        ++hits[at];
        if (pixel.shines && !hazy()) {
            sum[at] += glm::dvec3(pixel.emission);
            if (request.planes) add_planes(planes[at], pixel, glm::dvec3(pixel.emission), pass % 2);
            return;
        }
        glm::vec3 lx = shows_direct() ? pixel.direct : glm::vec3(0.0f);
        if (pixel.hit && shows_direct() && !points) lx += luminaires_direct(*world, pixel.receiver, &sample);
        if (pixel.hit && needs_paths()) {
            const PathLight path = (world->haze ? trace_path_in_haze : trace_path)(
                *world, pixel.receiver, shows_indirect() ? settings.bounces : 0, sample);
            if (shows_direct()) lx += path.direct;
            if (shows_indirect()) lx += path.indirect;
        }
        glm::dvec3 value(lx);
        if (request.quantity >= Quantity::radiance_direct) value *= glm::dvec3(pixel.albedo) / std::numbers::pi;
        if (request.quantity == Quantity::radiance) value += glm::dvec3(pixel.emission);
        if (hazy()) {
            const glm::vec3 before = scattered_light(*world, world->geometry->local(eye.position), pixel.along,
                                                     pixel.far, settings.bounces, sample);
            value = value * static_cast<double>(pixel.passed) + glm::dvec3(before);
            air[at] += before;
        }
        if (!is_finite(glm::vec3(value))) return;
        sum[at] += value;
        streams[at * kPixelStreams + stream] += static_cast<float>(luminance(value)) - luminance(pixel.opening);
        if (request.planes) add_planes(planes[at], pixel, value, pass % 2);
    }

    // value: radiance. What of it is no luminaire's own light nor emission is sampled, but for openings.
    void add_planes(Sums& sums, const Pixel& pixel, const glm::dvec3& value, std::uint32_t half) const {
        const glm::dvec3 computed =
            (glm::dvec3(pixel.emission) + glm::dvec3(pixel.direct) * glm::dvec3(pixel.albedo) / std::numbers::pi) *
            static_cast<double>(pixel.passed);
        sums.exact += glm::vec3(computed);
        sums.half[half] += glm::vec3(glm::max(value - computed, 0.0));
        sums.albedo += pixel.albedo;
        sums.normal += pixel.receiver.normal;
        sums.depth += pixel.inverse_depth;
        sums.depth_squared += pixel.inverse_depth * pixel.inverse_depth;
    }

    // Result: variance of the luminance of a pixel's mean over `passes` samples (at least kPixelStreams), from the
    // spread of its streams.
    double pixel_variance(std::size_t at, std::uint32_t passes) const {
        double means[kPixelStreams], mean = 0.0, squares = 0.0;
        for (std::uint32_t s = 0; s < kPixelStreams; ++s) {
            const std::uint32_t samples = passes / kPixelStreams + (s < passes % kPixelStreams ? 1 : 0);
            means[s] = static_cast<double>(streams[at * kPixelStreams + s]) / samples;
            mean += means[s] / kPixelStreams;
        }
        for (const double stream : means) squares += (stream - mean) * (stream - mean);
        return squares / (kPixelStreams * (kPixelStreams - 1));
    }

    double noise(std::uint32_t passes) const {
        double squares = 0.0, mean = 0.0;
        std::size_t count = 0;
        for (std::size_t at = 0; at < sum.size(); ++at) {
            if (hits[at] == 0) continue;
            ++count;
            squares += pixel_variance(at, passes);
            for (std::uint32_t s = 0; s < kPixelStreams; ++s)
                mean += static_cast<double>(streams[at * kPixelStreams + s]) / passes;
        }
        if (count == 0) return 0.0;
        if (mean <= 0.0) return passes >= kDarkPasses ? 0.0 : 1.0;
        return std::sqrt(squares / static_cast<double>(count)) / (mean / static_cast<double>(count));
    }

    // Passes between two checks, which do not depend on time: the same request gives the same picture.
    static std::uint32_t passes_after(std::uint32_t check) {
        return std::max<std::uint32_t>(kPixelStreams, check / 4 / kPixelStreams * kPixelStreams);
    }

    // Estimates the noise. final: of a picture that ends between two checks.
    void check(bool final) {
        progress.noise = exact ? 0.0 : noise(progress.passes);
        progress.noise_reached = exact || progress.noise <= kSafety * settings.noise;
        if (progress.noise_reached) progress.complete = true;
        last_check = progress.passes;
        if (!final) next_check += passes_after(next_check);
    }

    std::optional<double> seconds_left() const {
        std::optional<double> left;
        if (progress.complete || progress.passes == 0) return left;
        const double of_pass = seconds / progress.passes;
        if (last_check > 0) {
            const double more = progress.noise / (kSafety * settings.noise), needed = last_check * more * more;
            double end = next_check;
            for (std::uint32_t at = next_check; end < std::min<double>(needed, settings.max_passes);)
                end = at += passes_after(at);
            left = of_pass * (std::min<double>(end, settings.max_passes) - progress.passes);
        }
        if (settings.max_seconds > 0.0) left = std::min(left.value_or(1e300), settings.max_seconds - seconds);
        return left;
    }
};

Picture::Picture(std::shared_ptr<const World> world, const PictureRequest& request, const Settings& settings)
    : data_(new Data) {
    Data& d = *data_;
    d.world = std::move(world);
    if (request.bodies) d.bodies = body_geometry(d.world->bodies, *d.world->geometry);
    d.request = request;
    d.settings = settings;
    d.eye = eye_of(request.camera, request.width_px, request.height_px);
    const auto pixels = static_cast<std::size_t>(request.width_px) * static_cast<std::size_t>(request.height_px);
    if (!request.antialias) d.first.resize(pixels);
    d.sum.resize(pixels);
    if (d.hazy()) d.air.resize(pixels);
    if (request.planes) d.planes.resize(pixels);
    d.streams.resize(pixels * kPixelStreams);
    d.hits.resize(pixels);
    d.row_passes.resize(static_cast<std::size_t>(request.height_px));
    d.next_check = std::max<std::uint32_t>(kPixelStreams, d.settings.min_passes);
    d.points = d.world->all_points();
    d.exact =
        !request.antialias && !d.world->geometry->transmissive() && !d.needs_paths() && (d.points || !d.shows_direct());
}
Picture::~Picture() = default;

Progress Picture::refine(double seconds, std::stop_token stop) {
    Data& d = *data_;
    const std::int64_t begin_ns = monotonic_ns();
    const auto spent = [&] { return seconds_since(begin_ns); };
    // A pass that would end more than a twentieth late is not begun. The first always is: no picture has less.
    constexpr double kLate = 1.05;
    const auto late = [&] {
        return d.settings.max_seconds > 0.0 && d.progress.passes > 0 &&
               d.seconds + spent() + d.pass_seconds > kLate * d.settings.max_seconds;
    };
    if (d.settings.max_seconds > 0.0) seconds = std::min(seconds, d.settings.max_seconds - d.seconds);
    std::uint32_t batch = 1;
    while (!d.progress.complete && !stop.stop_requested()) {
        batch = std::min({batch, d.next_check - d.progress.passes, d.settings.max_passes - d.progress.passes});
        const double before = spent();
        const bool whole = parallel(d.request.height_px, d.settings.threads, d.settings.idle, stop, [&](int y) {
            std::uint32_t& done = d.row_passes[static_cast<std::size_t>(y)];
            for (const std::uint32_t end = d.progress.passes + batch; done < end; ++done) {
                for (int x = 0; x < d.request.width_px; ++x) d.add_pass(x, y, done);
            }
        });
        if (!whole) break;
        d.progress.passes += batch;
        d.pass_seconds = (spent() - before) / batch;
        if (d.progress.passes >= d.settings.max_passes || late()) d.progress.complete = true;
        if (d.exact || d.progress.passes == d.next_check)
            d.check(false);
        else if (d.progress.complete && d.progress.passes >= kPixelStreams)
            d.check(true);
        if (spent() >= seconds) break;
        batch = static_cast<std::uint32_t>(std::clamp((seconds - spent()) / std::max(d.pass_seconds, 1e-9), 1.0, 64.0));
    }
    d.seconds += spent();
    d.progress.seconds_left = d.seconds_left();
    return d.progress;
}

std::vector<float> Picture::values() const {
    const Data& d = *data_;
    std::vector<float> result(d.sum.size() * 4);
    for (std::size_t at = 0; at < d.sum.size(); ++at) {
        const std::uint32_t passes = d.row_passes[at / static_cast<std::size_t>(d.request.width_px)];
        if (passes == 0) continue;
        for (int k = 0; k < 3; ++k)
            result[at * 4 + static_cast<std::size_t>(k)] = static_cast<float>(d.sum[at][k] / passes);
        result[at * 4 + 3] = static_cast<float>(static_cast<double>(d.hits[at]) / passes);
    }
    return result;
}

std::vector<float> Picture::haze() const {
    const Data& d = *data_;
    std::vector<float> result(d.air.size() * 3);
    for (std::size_t at = 0; at < d.air.size(); ++at) {
        const std::uint32_t passes = d.row_passes[at / static_cast<std::size_t>(d.request.width_px)];
        for (int k = 0; passes > 0 && k < 3; ++k)
            result[at * 3 + static_cast<std::size_t>(k)] = d.air[at][k] / static_cast<float>(passes);
    }
    return result;
}

DenoisePlanes Picture::planes() const {
    const Data& d = *data_;
    const float passes = static_cast<float>(std::max(1u, d.progress.passes));
    const float halves[2] = {std::ceil(passes / 2.0f), std::floor(passes / 2.0f)};
    DenoisePlanes result{d.request.width_px, d.request.height_px};
    for (auto* plane : {&result.half[0], &result.half[1], &result.exact, &result.albedo, &result.normal})
        plane->resize(d.planes.size());
    result.inverse_depth.resize(d.planes.size());
    result.inverse_depth_variance.resize(d.planes.size());
    for (std::size_t at = 0; at < d.planes.size(); ++at) {
        const Data::Sums& sums = d.planes[at];
        const float hits = static_cast<float>(std::max(1u, d.hits[at])), depth = sums.depth / hits;
        for (std::size_t h = 0; h < 2; ++h) {
            const std::size_t from = halves[h] > 0.0f ? h : 0;
            result.half[h][at] = sums.half[from] / halves[from];
        }
        result.exact[at] = sums.exact / passes;
        result.albedo[at] = sums.albedo / passes;
        result.normal[at] = sums.normal / hits;
        result.inverse_depth[at] = depth;
        result.inverse_depth_variance[at] = std::max(0.0f, sums.depth_squared / hits - depth * depth);
    }
    return result;
}

}  // namespace gonio::trace
