#include "tests/bench/survey.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <stdexcept>

#include "protocol/schema/report.pb.h"
#include "server/assets/assets.h"
#include "server/exchange/import_mvr.h"
#include "server/render/renderer.h"
#include "server/scene/scene.h"
#include "server/trace/sampler.h"
#include "server/trace/sources.h"
#include "tests/bench/scene_hash.h"
#include "tests/bench/shown.h"
#include "tests/scenes/bench_scenes.h"
#include "tests/scenes/placed.h"
#include "tests/scenes/random_room.h"
#include "tests/scenes/scenes.h"

namespace gonio::bench {
namespace {

namespace fs = std::filesystem;

// Part of the hash of kept references: raise it when the same scene gets other points or other values.
constexpr std::uint32_t kVersion = 3;
constexpr double kBulbCd = 100.0;  // of the bulb in a scene without light

// One point, and what both qualities read there.
struct Pick {
    trace::MeterPoint at;
    double truth_lx = 0.0, noise_lx = 0.0;   // of the reference: indirect, and its standard error
    double shown_lx = 0.0, stated_lx = 0.0;  // of the interactive meter: indirect, and the error that it states
    double off_lx() const { return shown_lx - truth_lx; }
};

struct SurveyRow {
    std::string name;
    std::string refused;  // why the file could not be read
    std::vector<Pick> picks;
    double mean_lx = 0.0, rms = 0.0, noise = 0.0, bias = 0.0;  // over the mean; the reference's noise is subtracted
    std::size_t worst = 0;                                     // pick
    unsigned off_by_half = 0, off_by_two = 0, unjudged = 0, within = 0;
    double seconds = 0.0;
    unsigned bounces = 0;  // of the last solve
};

// Where somebody would stand in a scene whose file has no camera: of some points in its bounds the one that most
// surfaces are around, and the freest of those.
glm::dvec3 inside(const SceneAsset& asset, const trace::Geometry& geometry) {
    constexpr unsigned kPoints = 256, kRays = 32;
    glm::dvec3 best = 0.5 * (asset.bounds.min + asset.bounds.max);
    double most = -1.0;
    for (unsigned i = 0; i < kPoints; ++i) {
        trace::Sample sample(0x2c1b3c6du, i);
        const glm::vec2 xy = sample.next(), zw = sample.next();
        const glm::dvec3 at = glm::mix(asset.bounds.min, asset.bounds.max, glm::dvec3(xy.x, xy.y, zw.x));
        double met = 0.0, nearest = 1.0;
        for (unsigned k = 0; k < kRays; ++k) {
            trace::Sample direction(i, k);
            trace::SurfaceHit hit;
            if (!geometry.closest(geometry.local(at), trace::any_direction(direction.next()), 0.0f, false, hit))
                continue;
            met += 1.0 / kRays;
            nearest = std::min(nearest, static_cast<double>(hit.distance / geometry.extent()));
        }
        const double value = met + std::min(nearest, 0.1);
        if (value > most) most = value, best = at;
    }
    return best;
}

// So many places for bulbs: the first at the eye, each other halfway from one before to a surface.
std::vector<glm::dvec3> bulb_places(const glm::dvec3& eye, const trace::Geometry& geometry, unsigned count) {
    std::vector<glm::dvec3> places = {eye};
    for (std::uint32_t i = 0; places.size() < count; ++i) {
        trace::Sample sample(0x3c6ef372u, i);
        const glm::vec3 from = geometry.local(places[i % places.size()]), along = trace::any_direction(sample.next());
        trace::SurfaceHit hit;
        const bool met = geometry.closest(from, along, 0.0f, false, hit);
        if (!met && i < 64 * count) continue;  // in the end all may stand in one place
        places.push_back(geometry.origin() + glm::dvec3(met ? from + 0.5f * hit.distance * along : from));
    }
    return places;
}

// Points on the surfaces that diffuse walks from the eye and the luminaires reach, at the first to the fourth surface
// that they meet: light comes to corners that no camera shows. Backs of single-sided surfaces count as well, because
// light meets them.
std::vector<Pick> pick_points(const Scene& scene, const trace::Geometry& geometry, unsigned count) {
    constexpr unsigned kTries = 64, kMostSteps = 4;
    std::vector<glm::vec3> seeds = {geometry.local(scene.camera.eye)};
    for (const Light& light : scene.lights)
        if (!light.sun) seeds.push_back(geometry.local(light.position));
    std::vector<Pick> picks;
    for (unsigned walk = 0; walk < kTries * count && picks.size() < count; ++walk) {
        trace::Sample sample(0x5bd1e995u, walk);
        glm::vec3 from = seeds[walk % seeds.size()], along = trace::any_direction(sample.next());
        const unsigned steps = 1 + walk / static_cast<unsigned>(seeds.size()) % kMostSteps;
        trace::SurfaceHit hit;
        bool met = true;
        for (unsigned step = 0; step < steps && met; ++step) {
            met = geometry.closest(from, along, geometry.step_off(from), false, hit);
            from = hit.position + hit.geometric * geometry.step_off(hit.position);
            along = trace::around(hit.geometric, trace::cosine_hemisphere(sample.next()));
        }
        if (!met) continue;
        Pick pick;
        pick.at = {geometry.origin() + glm::dvec3(hit.position), glm::dvec3(hit.geometric), trace::Receives::plane};
        picks.push_back(pick);
    }
    return picks;
}

// What the path tracer reads at the picks, in rounds until each is sure enough or time is up.
void measure_reference(const Scene& scene, std::vector<Pick>& picks, double seconds) {
    // Standard errors: of the scene's mean and of the point's own value, or of the latter alone. Where light comes by
    // few paths, the first rounds miss it and their error is small for that reason.
    constexpr double kSure = 0.008, kRoughly = 0.1, kOwn = 0.005;
    constexpr double kRoundsOfNothing = 8.0;  // that say that a point is dark
    const auto began = std::chrono::steady_clock::now();
    const auto world = trace::make_world(scene);
    trace::Settings settings;
    settings.noise = 1e-6;
    settings.max_passes = 1u << 15;
    struct Sum {
        double light = 0.0, variance = 0.0, rounds = 0.0;
    };
    std::vector<Sum> sums(picks.size());
    for (settings.seed = 1;; ++settings.seed) {
        double mean = 0.0;
        for (const Sum& sum : sums) mean += sum.light / std::max(sum.rounds, 1.0) / static_cast<double>(picks.size());
        std::vector<trace::MeterPoint> points;
        std::vector<std::size_t> which;
        for (std::size_t i = 0; i < picks.size(); ++i) {
            const double rounds = std::max(sums[i].rounds, 1.0), own = sums[i].light / rounds,
                         error = std::sqrt(sums[i].variance) / rounds;
            if (sums[i].rounds >= (error > 0.0 ? 1.0 : kRoundsOfNothing) &&
                error <= std::max(std::min(kSure * mean, kRoughly * own), kOwn * own))
                continue;
            points.push_back(picks[i].at), which.push_back(i);
        }
        if (points.empty()) break;
        const auto readings = trace::measure(*world, points, settings);
        for (std::size_t k = 0; k < which.size(); ++k) {
            sums[which[k]].light += trace::luminance(readings[k].indirect_lx);
            sums[which[k]].variance += std::pow(readings[k].indirect_error_lx, 2.0);
            sums[which[k]].rounds += 1.0;
        }
        if (std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count() > seconds) break;
    }
    for (std::size_t i = 0; i < picks.size(); ++i) {
        picks[i].truth_lx = sums[i].light / std::max(sums[i].rounds, 1.0);
        picks[i].noise_lx = std::sqrt(sums[i].variance) / std::max(sums[i].rounds, 1.0);
    }
}

// The same, from the cache where it has them.
void refer(const Scene& scene, std::vector<Pick>& picks, const SurveyOptions& options) {
    Hash hash;
    hash.add(kVersion);
    hash.add(scene);
    hash.add(options.reference_seconds);
    for (const Pick& pick : picks) hash.add(pick.at.position), hash.add(pick.at.normal);
    char name[64];
    std::snprintf(name, sizeof name, "survey-%016llx.json", static_cast<unsigned long long>(hash.value));
    const fs::path path = fs::path(options.cache) / name;
    if (std::ifstream in(path); in) {
        const nlohmann::json kept = nlohmann::json::parse(in, nullptr, false);
        if (kept.is_array() && kept.size() == picks.size()) {
            for (std::size_t i = 0; i < picks.size(); ++i)
                picks[i].truth_lx = kept[i].at(0), picks[i].noise_lx = kept[i].at(1);
            return;
        }
    }
    measure_reference(scene, picks, options.reference_seconds);
    nlohmann::json kept = nlohmann::json::array();
    for (const Pick& pick : picks) kept.push_back({pick.truth_lx, pick.noise_lx});
    fs::create_directories(options.cache);
    const fs::path unfinished = path.string() + ".part";
    std::ofstream(unfinished) << kept;
    fs::rename(unfinished, path);
}

void judge(SurveyRow& row) {
    const double count = static_cast<double>(std::max<std::size_t>(row.picks.size(), 1));
    for (const Pick& pick : row.picks) row.mean_lx += pick.truth_lx / count;
    if (!(row.mean_lx > 0.0)) return;
    double squares = 0.0, noise = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < row.picks.size(); ++i) {
        const Pick& pick = row.picks[i];
        const double off = pick.off_lx(), slack = 0.05 * row.mean_lx;
        squares += off * off / count, noise += pick.noise_lx * pick.noise_lx / count, sum += off / count;
        if (std::abs(off) > std::abs(row.picks[row.worst].off_lx())) row.worst = i;
        // A point whose truth is not sure enough is not judged alone.
        if (pick.noise_lx > 0.1 * pick.truth_lx + 0.01 * row.mean_lx)
            ++row.unjudged;
        else if (std::abs(off) > 0.5 * pick.truth_lx + slack)
            ++row.off_by_half;
        if (pick.shown_lx > 2.0 * pick.truth_lx + slack || pick.shown_lx < 0.5 * pick.truth_lx - slack)
            ++row.off_by_two;
        if (std::abs(off) <= 2.0 * std::hypot(pick.stated_lx, pick.noise_lx)) ++row.within;
    }
    row.rms = std::sqrt(std::max(0.0, squares - noise)) / row.mean_lx;
    row.noise = std::sqrt(noise) / row.mean_lx;
    row.bias = sum / row.mean_lx;
}

SurveyRow survey(Renderer& renderer, const std::string& name, Scene scene, const SurveyOptions& options) {
    SurveyRow row;
    row.name = name;
    test::renew(scene);
    row.picks = pick_points(scene, *trace::geometry_of(scene), options.picks);
    refer(scene, row.picks, options);
    const auto began = std::chrono::steady_clock::now();
    for (bool ready = false; !ready;) {  // the links for narrow beams come once one is met
        if (!row.picks.empty())
            renderer.meter(scene, row.picks[0].at.position, row.picks[0].at.normal,
                           Renderer::MeterQuality::interactive);
        ready = renderer.ready(scene) == Readiness::all;
    }
    for (Pick& pick : row.picks) {
        const v1::MeterReading reading =
            renderer.meter(scene, pick.at.position, pick.at.normal, Renderer::MeterQuality::interactive);
        // A reading that is NaN or infinite counts as infinitely too bright, so that the scene becomes an outlier.
        const double lx = reading.indirect_lx();
        pick.shown_lx = std::isfinite(lx) ? lx : std::numeric_limits<double>::infinity();
        pick.stated_lx = reading.indirect_error_lx();
    }
    row.bounces = renderer.transport_stats().bounces();
    row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    judge(row);
    return row;
}

// A name that a file may have.
std::string file_name_of(std::string name) {
    for (char& c : name)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '-';
    return name;
}

// Writes what the scene's camera sees, both ways, at an exposure that suits the path tracer's picture.
void write_pictures(Renderer& renderer, const SurveyRow& row, Scene scene, const SurveyOptions& options) {
    constexpr unsigned kSamples = 256;
    constexpr double kMiddle = 100.0 / 12.5 / 0.18 * 0.5;  // half of what is white is the mean
    const double least_nit = 1e-3 * row.mean_lx;           // a camera in a sealed box sees nothing
    scene.width_px = 320, scene.height_px = 240;
    test::renew(scene);
    const std::vector<float> values = traced(scene, 1, kSamples);
    double sum_nit = 0.0, covered = 1e-9;
    for (std::size_t i = 0; i < values.size(); i += 4) {
        sum_nit += trace::luminance(glm::dvec3(values[i], values[i + 1], values[i + 2]));
        covered += static_cast<double>(values[i + 3]);
    }
    scene.exposure_ev100 = std::log2(kMiddle * std::max({sum_nit / covered, least_nit, 1e-6}));
    write_ppm(options.pictures, file_name_of(row.name) + "-reference", shown(values, scene));
    write_ppm(options.pictures, file_name_of(row.name) + "-live",
              shown(*renderer.capture(scene, View::beauty, scene.width_px, scene.height_px, false, trace::kAllBounces,
                                      kSamplesPerPixel)));
}

double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// What the rows say together. stated and true errors are over each scene's mean.
struct Summary {
    std::size_t scenes = 0, points = 0;
    unsigned off_by_half = 0, off_by_two = 0, unjudged = 0;
    double median_rms = 0.0, worst_rms = 0.0;
    double within = 0.0;  // share of points whose error is at most twice the stated one
    double median_stated = 0.0, median_true = 0.0;
    double median_bounces = 0.0;  // of the solves
    unsigned most_bounces = 0;
};

Summary summary_of(const std::vector<SurveyRow>& rows) {
    Summary summary;
    std::vector<double> rms, stated, off, bounces;
    unsigned within = 0;
    for (const SurveyRow& row : rows) {
        if (!row.refused.empty() || !(row.mean_lx > 0.0)) continue;
        ++summary.scenes;
        summary.points += row.picks.size();
        summary.off_by_half += row.off_by_half, summary.off_by_two += row.off_by_two;
        summary.unjudged += row.unjudged, within += row.within;
        rms.push_back(row.rms);
        bounces.push_back(row.bounces);
        summary.most_bounces = std::max(summary.most_bounces, row.bounces);
        summary.worst_rms = std::max(summary.worst_rms, row.rms);
        for (const Pick& pick : row.picks) {
            stated.push_back(pick.stated_lx / row.mean_lx);
            off.push_back(std::abs(pick.off_lx()) / row.mean_lx);
        }
    }
    summary.median_rms = median(rms), summary.median_bounces = median(bounces);
    summary.within = summary.points > 0 ? static_cast<double>(within) / static_cast<double>(summary.points) : 1.0;
    summary.median_stated = median(stated), summary.median_true = median(off);
    return summary;
}

void print(const SurveyRow& row, std::ostream& out) {
    char line[400];
    if (!row.refused.empty() || row.picks.empty()) {
        std::snprintf(line, sizeof line, "%-40.40s %s\n", row.name.c_str(),
                      row.refused.empty() ? "nothing is seen" : row.refused.c_str());
    } else {
        const Pick& worst = row.picks[row.worst];
        const glm::dvec3 p = worst.at.position, n = worst.at.normal;
        std::snprintf(
            line, sizeof line,
            "%-40.40s %3zu %9.4g %7.4f %7.4f %+7.4f %3u %3u %3u %6.1f  %.4g for %.4g +- %.2g, stated %.2g, at "
            "%.5g,%.5g,%.5g facing %.2f,%.2f,%.2f\n",
            row.name.c_str(), row.picks.size(), row.mean_lx, row.rms, row.noise, row.bias, row.off_by_half,
            row.off_by_two, row.unjudged, row.seconds, worst.shown_lx, worst.truth_lx, worst.noise_lx, worst.stated_lx,
            p.x, p.y, p.z, n.x, n.y, n.z);
    }
    out << line << std::flush;
}

nlohmann::json json_of(const SurveyRow& row) {
    nlohmann::json json = {{"scene", row.name}};
    if (!row.refused.empty()) return json["refused"] = row.refused, json;
    json.update({{"mean_lx", row.mean_lx},
                 {"rms", row.rms},
                 {"noise", row.noise},
                 {"bias", row.bias},
                 {"off_by_half", row.off_by_half},
                 {"off_by_two", row.off_by_two},
                 {"unjudged", row.unjudged},
                 {"bounces", row.bounces},
                 {"seconds", row.seconds}});
    for (const Pick& pick : row.picks) {
        const glm::dvec3 p = pick.at.position, n = pick.at.normal;
        json["picks"].push_back({{"point_m", {p.x, p.y, p.z}},
                                 {"normal", {n.x, n.y, n.z}},
                                 {"reference_lx", pick.truth_lx},
                                 {"reference_error_lx", pick.noise_lx},
                                 {"interactive_lx", pick.shown_lx},
                                 {"stated_error_lx", pick.stated_lx}});
    }
    return json;
}

// The files of the paths; built-in scenes by name.
std::vector<std::string> files_of(const std::vector<std::string>& paths) {
    std::vector<std::string> files;
    for (const std::string& path : paths) {
        if (!fs::is_directory(path)) {
            if (!is_built_in(path) && path != "corridor" && path != "stage" && !fs::exists(path))
                throw std::runtime_error("there is no file, folder or built-in scene '" + path + "'");
            files.push_back(path);
            continue;
        }
        std::vector<std::string> found;
        for (const auto& entry : fs::recursive_directory_iterator(path)) {
            const std::string kind = entry.path().extension().string();
            if (entry.is_regular_file() && (kind == ".gltf" || kind == ".glb" || kind == ".mvr"))
                found.push_back(entry.path().string());
        }
        std::sort(found.begin(), found.end());
        files.insert(files.end(), found.begin(), found.end());
    }
    return files;
}

// A scene, or why there is none. One without luminaires has bulbs.
std::optional<Scene> scene_of_file(const std::string& file, const SurveyOptions& options, std::string& refused) {
    std::shared_ptr<const SceneAsset> asset;
    if (file == "corridor" || file == "stage") {
        asset = file == "corridor" ? test::make_corridor() : test::make_stage(4);
    } else {
        LoadOptions load;
        load.max_albedo = options.max_albedo;
        const auto loaded = exchange::load_any_scene(file, "", load);
        if (!loaded) {
            refused = loaded.error().text();
            return std::nullopt;
        }
        asset = *loaded;
    }
    Scene scene = scene_of(asset);
    const auto geometry = trace::geometry_of(scene);
    if (asset->cameras.empty()) scene.camera.eye = inside(*asset, *geometry);
    if (scene.lights.empty()) {
        const Camera camera = scene.camera;
        auto lit = std::make_shared<SceneAsset>(*asset);
        for (const glm::dvec3& place : bulb_places(camera.eye, *geometry, options.bulbs)) {
            lit->lights.push_back(test::light_seed(test::isotropic(kBulbCd), place));
            lit->lights.back().name = "bulb " + std::to_string(lit->lights.size());
        }
        scene = scene_of(lit);
        scene.camera = camera;
    }
    return scene;
}

}  // namespace

void run_survey(const SurveyOptions& options, std::ostream& out, std::ostream& progress) {
    const std::vector<std::string> files = files_of(options.paths);
    unsigned long long seed = 0, count = 0;
    char rest = 0;
    if (!options.rooms.empty() && std::sscanf(options.rooms.c_str(), "%llu:%llu%c", &seed, &count, &rest) != 2)
        throw std::runtime_error("--rooms must be SEED:COUNT, not '" + options.rooms + "'");
    if (files.empty() && count == 0) throw std::runtime_error("nothing to survey: name files, folders or --rooms");
    const auto context = gl::Context::create({options.device, false});
    std::vector<SurveyRow> rows;
    std::ostream& table = options.json ? progress : out;
    table << "scene                                    pts   mean lx  rms/mean  noise    bias  1/2  x2   ?  "
             "seconds  worst point\n";
    const auto take = [&](const std::string& name, std::optional<Scene> scene, const std::string& refused) {
        Renderer renderer(*context);
        renderer.set_links(options.links);
        rows.push_back(scene ? survey(renderer, name, *scene, options) : SurveyRow{name, refused});
        print(rows.back(), table);
        if (scene && !options.pictures.empty()) write_pictures(renderer, rows.back(), std::move(*scene), options);
    };
    for (const std::string& file : files) {
        std::string refused;
        std::optional<Scene> scene = scene_of_file(file, options, refused);
        take(file, std::move(scene), refused);
    }
    for (unsigned long long i = seed; i < seed + count; ++i)
        take("room " + std::to_string(i), test::random_room(i), "");
    const Summary all = summary_of(rows);
    char text[600];
    std::snprintf(text, sizeof text,
                  "%zu scenes, %zu points: off by more than half %u, by more than two %u, not judged %u\nrms over the "
                  "mean: median scene %.4f, worst %.4f\nwithin twice the stated error: %.3f of the points; median "
                  "stated error %.4f, true %.4f of the mean\nbounces of a solve: median scene %.0f, most %u\n",
                  all.scenes, all.points, all.off_by_half, all.off_by_two, all.unjudged, all.median_rms, all.worst_rms,
                  all.within, all.median_stated, all.median_true, all.median_bounces, all.most_bounces);
    table << text;
    for (const SurveyRow& row : rows)
        if (row.off_by_half + row.off_by_two > 0) table << "outlier: " << row.name << "\n";
    if (!options.json) return;
    nlohmann::json json = {
        {"renderer", context->renderer()},    {"scenes", all.scenes},           {"points", all.points},
        {"off_by_half", all.off_by_half},     {"off_by_two", all.off_by_two},   {"unjudged", all.unjudged},
        {"median_rms", all.median_rms},       {"worst_rms", all.worst_rms},     {"within_twice_stated", all.within},
        {"median_stated", all.median_stated}, {"median_true", all.median_true}, {"median_bounces", all.median_bounces},
        {"most_bounces", all.most_bounces}};
    for (const SurveyRow& row : rows) json["rows"].push_back(json_of(row));
    out << json.dump(2) << "\n";
}

}  // namespace gonio::bench
