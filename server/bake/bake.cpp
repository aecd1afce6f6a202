#include "server/bake/bake.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <set>

#include "server/bake/air.h"
#include "server/bake/direct.h"
#include "server/bake/gather.h"
#include "server/bake/key.h"
#include "server/bake/validity.h"
#include "server/base/clock.h"
#include "server/scene/apply.h"
#include "server/scene/scene.h"
#include "server/trace/sampler.h"

namespace gonio::bake {
namespace {

constexpr int kVersion = 2;  // of what a part holds: another one computes anew
constexpr const char* kEmissive = "emissive";
constexpr double kMostReflectance = 0.99;  // in the estimate of what further bounces add

int whole_directions(const BakeSettings& settings) {
    return (std::clamp(settings.directions, 1, kMostDirections) + 31) / 32 * 32;
}

// The scene with every light at level 1, white, and the master at 1.
Scene at_level_one(const Scene& scene) {
    Scene result = scene;
    result.master_ratio = 1.0;
    for (Light& light : result.lights) {
        light.level_ratio = light.shutter_ratio = 1.0;
        light.strobe_hz = 0.0;
        light.color = glm::dvec3(1.0);
        light.cct_k = light.tint_duv = 0.0;
        light.gel = nullptr;
    }
    return result;
}

bool is_emissive(const SceneAsset& asset) {
    return std::any_of(asset.instances.begin(), asset.instances.end(), [&](const Instance& instance) {
        const Mesh& mesh = asset.meshes[static_cast<std::size_t>(instance.mesh)];
        return asset.materials[static_cast<std::size_t>(mesh.material)].emissive_nit != glm::vec3(0.0f);
    });
}

void add_settings(Key& key, const Scene& scene, const BakeSettings& settings) {
    key.add(kVersion);
    key.add(whole_directions(settings));
    key.add(settings.openings);
    key.add(settings.part);
    key.add(settings.seed);
    const HazeValues& haze = scene.haze;
    key.add(haze.extinction_per_m);
    if (!(haze.extinction_per_m > 0.0)) return;
    for (const double value : {haze.albedo, haze.g, haze.layer_height_m}) key.add(value);
    key.add(settings.steps);
    key.add(settings.even_steps);
    key.add(settings.air_rays);
}

std::string key_of_light(const Scene& scene, const Light& light, const trace::Luminaire& luminaire,
                         const BakeSettings& settings) {
    Key key;
    add_settings(key, scene, settings);
    const ies::PhotometricWeb& web = light.shining()->photometry.web;
    key.add(web.goniometer);
    key.add(web.v_rad);
    key.add(web.h_rad);
    key.add(web.candela);
    for (int i = 0; i < 3; ++i) {
        key.add(luminaire.position[i]);
        for (int j = 0; j < 3; ++j) key.add(luminaire.world_from_light[i][j]);
    }
    key.add(luminaire.weight.x);
    key.add(luminaire.light);  // the seed of its samples
    key.add(luminaire.opening.shape);
    for (const Length side : {luminaire.opening.length, luminaire.opening.width, luminaire.opening.height})
        key.add(side.in(m));
    return key.text();
}

std::string combined(const std::string& layout, const std::string& source, const std::string& part) {
    Key key;
    key.add(layout);
    key.add(source);
    key.add(part);
    return key.text();
}

// A source while it is computed.
struct Running {
    const Source* source = nullptr;
    const trace::Luminaire* luminaire = nullptr;
    float gain = 1.0f;  // of the luminaire at level 1: multiplier, TILT factor
    AirVolume volume;
    SourceMaps maps;
    std::vector<float> last;  // the newest bounce, three channels; before the first the direct light
    // Sums of luminance × area over each sheet of the atlas: of all light, of the newest bounce, of the one before it.
    std::vector<double> all_of, last_of, before_of;
    bool done = false;
};

Error stopped() {
    return {"stopped", "bake", "", "the bake was stopped; what is finished stays"};
}

}  // namespace

std::vector<std::string> file_names(const std::vector<std::string>& texts) {
    std::vector<std::string> names;
    std::set<std::string> taken;
    const auto lower = [](std::string text) {
        for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        return text;
    };
    for (const std::string& text : texts) {
        std::string name;
        for (const char c : text) {
            const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
            if (name.size() < kNameBytes) name += plain ? c : '_';
        }
        if (name.empty()) name = "light";
        std::string free = name;
        for (int i = 2; !taken.insert(lower(free)).second; ++i) {
            const std::string end = "-" + std::to_string(i);
            free = name.substr(0, kNameBytes - end.size()) + end;
        }
        names.push_back(std::move(free));
    }
    return names;
}

MemoryNeed memory_of(const AtlasSettings& settings) {
    const std::size_t pixels = static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height);
    // Texels, the atlas, the plan of filling; three pictures at a time and the sum.
    MemoryNeed need;
    need.fixed = pixels * (sizeof(Texel) + 4 + 4 + 3 * 12 + 16 + 8);
    // Direct, its error, indirect, the last bounce, what leaves, what arrives and their errors.
    need.per_source = pixels * (4 + 4 + 12 + 12 + 12 + 12 + 4 + 4);
    return need;
}

Result<std::vector<Source>> sources_of(const Scene& scene, const trace::Geometry& geometry,
                                       const BakeSettings& settings) {
    const Scene plain = at_level_one(scene);
    const std::vector<trace::Luminaire> luminaires = trace::luminaires_of(plain, geometry);
    std::vector<Source> sources;
    std::vector<std::string> texts;
    for (const trace::Luminaire& luminaire : luminaires) {
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            const Light& light = scene.lights[i];
            if (light.id != luminaire.light) continue;
            Source& source = sources.emplace_back();
            source.light = light.name;
            source.key = key_of_light(scene, light, luminaire, settings);
            const glm::dvec3 whole = own_weight(plain.lights[i]);
            for (int c = 0; c < 3; ++c)
                source.weight[c] = static_cast<float>(whole[c] > 0.0 ? light_weight(scene, light)[c] / whole[c] : 0.0);
            texts.push_back(light.name);
        }
    }
    if (!scene.emission_hidden && is_emissive(*scene.asset)) {
        Source& source = sources.emplace_back();
        source.direct_channels = 3;
        Key key;
        add_settings(key, scene, settings);
        key.add(std::string_view(kEmissive));
        source.key = key.text();
        texts.emplace_back(kEmissive);
    }
    if (sources.empty())
        return Error{"nothing_to_bake", "bake.scene", scene.asset->name, "the scene has no light to bake"};
    if (sources.size() > kMostSources)
        return Error{"too_many_lights", "bake.scene", std::to_string(sources.size()),
                     "a bake has at most " + std::to_string(kMostSources) + " sources of light"};
    const std::vector<std::string> names = file_names(texts);
    for (std::size_t i = 0; i < sources.size(); ++i) sources[i].name = names[i];
    return sources;
}

Result<Layout> lay_out(const Scene& scene, const trace::Geometry& geometry, const BakeSettings& settings, Work& work) {
    const MemoryNeed need = memory_of(settings.atlas);
    if (need.fixed + need.per_source > settings.memory_bytes)
        return Error{"too_large", "bake.memory", std::to_string(settings.memory_bytes >> 20) + " MiB",
                     "maps of " + std::to_string(settings.atlas.width) + "x" + std::to_string(settings.atlas.height) +
                         " take " + std::to_string(((need.fixed + need.per_source) >> 20) + 1) + " MiB"};
    AtlasSettings atlas_settings = settings.atlas;
    atlas_settings.threads = work.threads;
    auto atlas = make_atlas(geometry, atlas_settings, work.stop);
    if (!atlas) return atlas.error().code == "stopped" ? stopped() : atlas.error();
    Layout layout;
    layout.atlas = std::move(*atlas);
    if (!find_invalid(layout.atlas, geometry, work.threads, work.stop)) return stopped();
    layout.fill = plan_fill(layout.atlas);
    glm::dvec3 albedo(0.0);
    Key key;
    key.add(kVersion);
    key.add(layout.atlas.width);
    key.add(layout.atlas.height);
    for (const Texel& texel : layout.atlas.texels) {
        const double area = static_cast<double>(texel.area_m2);
        (texel.valid ? layout.area_m2 : layout.invalid_m2) += area;
        if (texel.valid) albedo += area * glm::dvec3(texel.albedo);
        key.add(texel.pixel);
        key.add(texel.valid);
        for (int c = 0; c < 3; ++c) {
            for (const float value :
                 {texel.position[c], texel.normal[c], texel.geometric[c], texel.albedo[c], texel.emission[c]})
                key.add(value);
        }
    }
    // What stands in the way casts shadows also where no map shows it.
    for (std::size_t i = 0; i < scene.asset->instances.size(); ++i) {
        const auto positions = geometry.positions(static_cast<int>(i));
        key.add(positions.data(), positions.size_bytes());
        const Mesh& mesh = scene.asset->meshes[static_cast<std::size_t>(scene.asset->instances[i].mesh)];
        key.add(mesh.indices);
        const Material& material = scene.asset->materials[static_cast<std::size_t>(mesh.material)];
        key.add(material.double_sided);
        key.add(material.alpha_mask);
        key.add(material.alpha_blend);
        key.add(material.transmission);
        key.add(material.base_color.a);
    }
    if (layout.area_m2 > 0.0) layout.mean_albedo = glm::vec3(albedo / layout.area_m2);
    layout.key = key.text();
    return layout;
}

double mean_over_area(const Layout& layout, std::span<const float> values, int channels) {
    double sum = 0.0;
    for (std::size_t i = 0; i < layout.atlas.texels.size(); ++i) {
        const Texel& texel = layout.atlas.texels[i];
        if (!texel.valid) continue;
        const float value = channels == 1
                                ? values[i]
                                : trace::luminance(glm::vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]));
        sum += static_cast<double>(texel.area_m2) * static_cast<double>(value);
    }
    return layout.area_m2 > 0.0 ? sum / layout.area_m2 : 0.0;
}

namespace {

template <typename Value>  // of a texel, per area
std::vector<double> sums_over_sheets(const Layout& layout, const Value& value) {
    std::vector<double> sums(layout.atlas.places.size(), 0.0);
    for (std::size_t i = 0; i < layout.atlas.texels.size(); ++i) {
        const Texel& texel = layout.atlas.texels[i];
        if (texel.valid) sums[static_cast<std::size_t>(texel.sheet)] += static_cast<double>(texel.area_m2) * value(i);
    }
    return sums;
}
std::vector<double> areas_of_sheets(const Layout& layout) {
    return sums_over_sheets(layout, [](std::size_t) { return 1.0; });
}
// values: three for each texel. Result: luminance times area.
std::vector<double> sums_of_sheets(const Layout& layout, std::span<const float> values) {
    return sums_over_sheets(layout, [&](std::size_t i) {
        return static_cast<double>(trace::luminance(glm::vec3(values[3 * i], values[3 * i + 1], values[3 * i + 2])));
    });
}

// One bake: what its steps share.
struct Bake {
    const Scene& scene;
    const trace::Geometry& geometry;
    const Layout& layout;
    const BakeSettings& settings;
    const PartStore& store;
    const BakeEvents& events;
    Work& work;
    AirSettings air;
    std::size_t texels = 0;
    int parts_begun = 0;

    void begin(const std::string& what, int bounce) const {
        if (events.begins) events.begins(what, bounce, settings.bounces);
    }

    void take(Running& running, PartValues part, bool bounce, bool computed) const {
        SourceMaps& maps = running.maps;
        ++(computed ? maps.computed : maps.taken_over);
        maps.rays += part.rays;
        maps.seconds += part.seconds;
        if (!bounce) {
            maps.direct = std::move(part.values);
            maps.error = std::move(part.error);
            maps.mean_direct_lx = mean_over_area(layout, maps.direct, running.source->direct_channels);
            running.last.resize(3 * texels);
            for (std::size_t i = 0; i < texels; ++i) {
                for (std::size_t c = 0; c < 3; ++c)
                    running.last[3 * i + c] =
                        running.source->direct_channels == 3 ? maps.direct[3 * i + c] : maps.direct[i];
            }
            running.all_of = running.last_of = sums_of_sheets(layout, running.last);
            return;
        }
        for (std::size_t i = 0; i < texels; ++i) maps.error[i] = std::hypot(maps.error[i], part.error[i]);
        for (std::size_t i = 0; i < 3 * texels; ++i) maps.indirect[i] += part.values[i];
        maps.mean_bounces_lx.push_back(mean_over_area(layout, part.values, 3));
        running.last = std::move(part.values);
        running.before_of = std::exchange(running.last_of, sums_of_sheets(layout, running.last));
        for (std::size_t k = 0; k < running.all_of.size(); ++k) running.all_of[k] += running.last_of[k];
    }

    // Result: what all further bounces can add, if each keeps the same share r of the one before it: r/(1 − r) × last.
    static double rest_of(double last, double before, double reflects) {
        const double r = std::min(before > 0.0 ? std::max(reflects, last / before) : reflects, kMostReflectance);
        return r / (1.0 - r) * last;
    }
    double reflects() const {
        const glm::vec3& albedo = layout.mean_albedo;
        return static_cast<double>(std::max({albedo.r, albedo.g, albedo.b}));
    }
    // Result: the greatest part of its light that further bounces can add to a sheet. A cavity keeps light that a scene
    // has lost on the mean. Dim sheets count by a hundredth of the mean.
    double greatest_rest(const Running& running, double all) const {
        double greatest = 0.0;
        if (running.before_of.empty()) return greatest;
        const std::vector<double> areas_m2 = areas_of_sheets(layout);
        for (std::size_t k = 0; k < areas_m2.size(); ++k) {
            const double light = running.all_of[k] + 0.01 * all * areas_m2[k];
            if (light > 0.0)
                greatest = std::max(greatest, rest_of(running.last_of[k], running.before_of[k], reflects()) / light);
        }
        return greatest;
    }
    // Adds it to the error of each texel, as a share of the newest bounce there.
    void add_rest_to_error(Running& running) const {
        if (running.before_of.empty()) return;
        for (std::size_t i = 0; i < texels; ++i) {
            const auto k = static_cast<std::size_t>(layout.atlas.texels[i].sheet);
            if (!(running.last_of[k] > 0.0)) continue;
            const double times = rest_of(running.last_of[k], running.before_of[k], reflects()) / running.last_of[k];
            const float newest =
                trace::luminance(glm::vec3(running.last[3 * i], running.last[3 * i + 1], running.last[3 * i + 2]));
            running.maps.error[i] = std::hypot(running.maps.error[i], static_cast<float>(times) * newest);
        }
    }

    // Whether further bounces could still add what counts: about r/(1 − r) times the last one, r what each keeps of the
    // one before: the mean reflectance, or more where light stays in a bright part of the scene. To a sheet they may
    // add five times as large a part as to the mean.
    bool goes_on(Running& running) const {
        const SourceMaps& maps = running.maps;
        double all = maps.mean_direct_lx;
        for (const double lx : maps.mean_bounces_lx) all += lx;
        const double last = maps.mean_bounces_lx.empty() ? maps.mean_direct_lx : maps.mean_bounces_lx.back();
        const std::vector<double>& bounces = maps.mean_bounces_lx;
        running.maps.rest_lx = rest_of(last, bounces.size() > 1 ? bounces[bounces.size() - 2] : 0.0, reflects());
        // What the air scatters first comes with the first bounce.
        if (maps.mean_bounces_lx.empty() && air.haze && all > 0.0) return true;
        return running.maps.rest_lx > settings.tolerance * all ||
               greatest_rest(running, all) > 5.0 * settings.tolerance;
    }

    Result<bool> direct(Running& running) const {
        const Source& source = *running.source;
        const std::string key = combined(layout.key, source.key, "direct");
        const auto values = static_cast<std::size_t>(source.direct_channels) * texels;
        if (auto part = store.load(source.name + "_direct", key, values, texels)) {
            take(running, std::move(*part), false, false);
            return true;
        }
        begin(source.name + ": direct", 0);
        const std::int64_t begin_ns = monotonic_ns();
        const std::uint64_t rays = work.rays;
        PartValues part;
        part.values.resize(values);
        part.error.resize(texels);
        if (running.luminaire != nullptr) {
            const DirectSettings direct{settings.openings, settings.part, 32, settings.seed, air.haze};
            if (!direct_light(layout.atlas, geometry, *running.luminaire, direct, part.values, part.error, work))
                return stopped();
            for (float& value : part.values) value *= running.gain;
            for (float& value : part.error) value *= running.gain;
        } else {
            std::vector<glm::vec3> leaving(texels), arrives(texels);
            for (std::size_t i = 0; i < texels; ++i)
                leaving[i] = std::numbers::pi_v<float> * layout.atlas.texels[i].emission;
            if (!gather_bounce(leaving, {}, 1, 0, arrives, part.error)) return stopped();
            for (std::size_t i = 0; i < texels; ++i) {
                for (std::size_t c = 0; c < 3; ++c) part.values[3 * i + c] = arrives[i][static_cast<int>(c)];
            }
        }
        part.rays = work.rays - rays;
        part.seconds = seconds_since(begin_ns);
        store.save(source.name + "_direct", key, part);
        take(running, std::move(part), false, true);
        return true;
    }

    bool gather_bounce(std::span<const glm::vec3> leaving, std::span<const GatheredAir> scatters, std::size_t sources,
                       int bounce, std::span<glm::vec3> arrives, std::span<float> error) const {
        GatherSettings gathering{whole_directions(settings),
                                 trace::mix_bits(settings.seed, static_cast<std::uint32_t>(1000 + bounce)), air};
        return gather(layout.atlas, geometry, gathering, leaving, scatters, sources, arrives, error, work);
    }

    // One bounce of those that are not done; they share the rays.
    Result<bool> bounce(std::vector<Running*> group, int number) const {
        const std::string name = "_bounce" + std::to_string(number);
        const auto key = [&](const Running& running) { return combined(layout.key, running.source->key, name); };
        std::erase_if(group, [&](Running* running) {
            auto part = store.load(running->source->name + name, key(*running), 3 * texels, texels);
            if (part) take(*running, std::move(*part), true, false);
            return part.has_value();
        });
        if (group.empty()) return true;
        const std::size_t n = group.size();
        begin((n == 1 ? group.front()->source->name : std::to_string(n) + " sources") + ": bounce " +
                  std::to_string(number),
              number);
        const std::int64_t begin_ns = monotonic_ns();
        const std::uint64_t rays = work.rays;
        std::vector<glm::vec3> leaving(n * texels), arrives(n * texels);
        std::vector<float> error(n * texels);
        std::vector<GatheredAir> scatters;
        for (std::size_t s = 0; s < n; ++s) {
            std::vector<float>& last = group[s]->last;
            fill_invalid(layout.atlas, layout.fill, last, 3);
            for (std::size_t i = 0; i < texels; ++i)
                leaving[i * n + s] =
                    layout.atlas.texels[i].albedo * glm::vec3(last[3 * i], last[3 * i + 1], last[3 * i + 2]);
        }
        if (number == 1 && air.haze) {
            for (Running* running : group) {
                if (running->luminaire != nullptr && !air.shadow_rays && running->volume.passed.empty()) {
                    running->volume = air_volume(geometry, *running->luminaire, air, work);
                    if (running->volume.passed.empty()) return stopped();
                }
                scatters.push_back({running->luminaire, &running->volume});
            }
            // Scattered light is in candela without the luminaire's weight: surfaces are brought to the same.
            for (std::size_t s = 0; s < n; ++s) {
                for (std::size_t i = 0; i < texels; ++i) leaving[i * n + s] /= group[s]->gain;
            }
        }
        if (!gather_bounce(leaving, scatters, n, number, arrives, error)) return stopped();
        const double seconds = seconds_since(begin_ns) / static_cast<double>(n);
        for (std::size_t s = 0; s < n; ++s) {
            PartValues part;
            part.values.resize(3 * texels);
            part.error.resize(texels);
            const float gain = scatters.empty() ? 1.0f : group[s]->gain;
            for (std::size_t i = 0; i < texels; ++i) {
                for (std::size_t c = 0; c < 3; ++c)
                    part.values[3 * i + c] = gain * arrives[i * n + s][static_cast<int>(c)];
                part.error[i] = gain * error[i * n + s];
            }
            part.rays = (work.rays - rays) / n;
            part.seconds = seconds;
            store.save(group[s]->source->name + name, key(*group[s]), part);
            take(*group[s], std::move(part), true, true);
        }
        return true;
    }

    Result<bool> run_group(std::vector<Running>& group) const {
        for (Running& running : group) {
            if (const auto done = direct(running); !done) return done.error();
            running.maps.indirect.assign(3 * texels, 0.0f);
            running.done = !goes_on(running);
        }
        for (int number = 1; number <= settings.bounces; ++number) {
            std::vector<Running*> left;
            for (Running& running : group) {
                if (!running.done) left.push_back(&running);
            }
            if (left.empty()) break;
            if (const auto done = bounce(left, number); !done) return done.error();
            for (Running* running : left) running->done = !goes_on(*running);
        }
        for (Running& running : group) {
            if (settings.bounces == kMostBounces) add_rest_to_error(running);  // fewer are what was asked for
            if (!events.finished) continue;
            if (const auto kept = events.finished(layout, *running.source, running.maps); !kept) return kept.error();
        }
        return true;
    }
};

}  // namespace

Result<bool> bake(const Scene& scene, const trace::Geometry& geometry, const Layout& layout,
                  const std::vector<Source>& sources, const BakeSettings& settings, const PartStore& store,
                  const BakeEvents& events, Work& work) {
    const Scene plain = at_level_one(scene);
    const std::vector<trace::Luminaire> luminaires = trace::luminaires_of(plain, geometry);
    const MemoryNeed need = memory_of(settings.atlas);
    const std::size_t room = settings.memory_bytes - std::min(settings.memory_bytes, need.fixed),
                      at_once =
                          std::clamp<std::size_t>(room / std::max<std::size_t>(need.per_source, 1), 1, kMostSources);
    const AirSettings air{haze_of(scene, geometry.origin()), std::clamp(settings.steps, 1, kMostSteps),
                          settings.even_steps, settings.air_rays, settings.openings};
    Bake steps{scene, geometry, layout, settings, store, events, work, air, layout.atlas.texels.size()};
    for (std::size_t first = 0; first < sources.size(); first += at_once) {
        std::vector<Running> group;
        for (std::size_t i = first; i < std::min(sources.size(), first + at_once); ++i) {
            Running& running = group.emplace_back();
            running.source = &sources[i];
            for (std::size_t k = 0; k < luminaires.size(); ++k) {
                const auto light = std::find_if(scene.lights.begin(), scene.lights.end(),
                                                [&](const Light& l) { return l.id == luminaires[k].light; });
                if (sources[i].light.empty() || light == scene.lights.end() || light->name != sources[i].light)
                    continue;
                running.luminaire = &luminaires[k];
                running.gain = luminaires[k].weight.x;
            }
        }
        if (const auto done = steps.run_group(group); !done) return done.error();
    }
    return true;
}

}  // namespace gonio::bake
