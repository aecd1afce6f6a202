// Fixtures of a show -> lights: a web for each beam, where it hangs and where it aims.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ies/core/printed.h"
#include "protocol/text/shortened_text.h"
#include "server/assets/gltf_import.h"
#include "server/exchange/axes.h"
#include "server/exchange/beam_web.h"
#include "server/exchange/import_parts.h"
#include "server/exchange/xml_read.h"
#include "server/scene/light_tables.h"
#include "server/scene/limits.h"
#include "server/scene/white.h"

namespace gonio::exchange {
namespace {

std::string unique_name(ShowImport& import, const std::string& wanted) {
    const std::string base = wanted.empty() ? "fixture" : wanted;
    std::string name = shortened_text(base, kMaxNameBytes);
    for (int number = 2; import.light_names.contains(name); ++number) {
        const std::string suffix = " " + std::to_string(number);
        name = shortened_text(base, kMaxNameBytes - suffix.size()) + suffix;
    }
    import.light_names.insert(name);
    return name;
}

// Of a mode, bytes: its geometries, channels and patched channels, with their names.
constexpr std::size_t kBytesOfTypePart = 1024;

std::size_t parts_of(const gdtf::FixtureType& type) {
    std::size_t parts = 0;
    for (const gdtf::Mode& mode : type.modes) {
        parts += mode.geometries.size() + mode.patched.size();
        for (const gdtf::Channel& channel : mode.channels) parts += 1 + channel.functions.size();
    }
    return parts;
}

// Result: the fixture type of the entry, read once; nullptr where it cannot be read, which has been noted.
const gdtf::FixtureType* type_of(ShowImport& import, const std::string& entry) {
    const auto [at, fresh] = import.types.try_emplace(entry);
    if (!fresh) return at->second ? &*at->second : nullptr;
    auto bytes = import.archive.read(entry);
    std::optional<Error> failed;
    if (!bytes) {
        failed = bytes.error();
    } else if (auto archive = open_zip(std::move(*bytes), gdtf::kGdtfLimits); !archive) {
        failed = archive.error();
    } else if (auto type = gdtf::read_gdtf(*archive); !type) {
        failed = type.error();
    } else if (auto full = take_memory(import.room, parts_of(*type), kBytesOfTypePart, entry)) {
        failed = *full;
    } else {
        at->second = std::move(*type);
        import.report.add(Outcome::taken, "fixture type", entry);
        import.report.add(at->second->report, at->second->name);
        read_photometric(import, *archive, *at->second);
        read_gobos(import, *archive, *at->second);
        read_body_models(import, *archive, *at->second);
        return &*at->second;
    }
    import.report.add(Outcome::left_out, "a GDTF file cannot be read: " + failed->code, named(entry, *failed));
    return nullptr;
}

// Photometry of the same name as the fixture's type or the fixture.
std::shared_ptr<const Profile> paired_profile(ShowImport& import, const mvr::Fixture& fixture,
                                              const std::string& name) {
    std::string stem = fixture.entry;
    if (stem.size() > 5) stem.resize(stem.size() - 5);
    for (const std::string& one : {stem, fixture.spec, name}) {
        if (one.empty()) continue;
        for (const char* extension : {".ies", ".ldt"}) {
            const auto found = import.entries.find(one + extension, extension);
            if (found.entry.empty()) continue;
            const auto [at, fresh] = import.profiles.try_emplace("file " + found.entry);
            std::shared_ptr<const Profile>& profile = at->second;  // null: it cannot be read
            if (profile) return profile;
            if (!fresh) continue;
            const auto bytes = import.archive.read(found.entry);
            auto made = bytes ? make_profile(shortened_text(found.entry, kMaxNameBytes), *bytes)
                              : Result<std::shared_ptr<const Profile>>(bytes.error());
            if (made)
                if (auto full =
                        take_memory(import.room, kBytesOfProfile + kBytesPerFileByte * bytes->size(), 1, found.entry))
                    made = *full;
            if (!made) {
                import.report.add(Outcome::left_out, "photometry cannot be read: " + made.error().code,
                                  named(found.entry, made.error()));
                continue;
            }
            import.report.add(Outcome::taken, "photometry of a fixture by its file's name", found.entry);
            tables_of(**made);
            return profile = *made;
        }
    }
    return nullptr;
}

// What a fixture has whose light nobody knows: it is there and dark until it gets another profile.
std::shared_ptr<const Profile> dark_profile(ShowImport& import, const mvr::Fixture& fixture, const std::string& name) {
    import.report.add(Outcome::left_out, "a fixture is dark: it has neither GDTF nor photometry; changes lux", name);
    const std::string type = fixture.spec.empty() ? "unknown fixture" : fixture.spec;
    std::shared_ptr<const Profile>& profile = import.profiles["dark " + type];
    if (!profile)
        profile = unlit_profile(shortened_text(type, kMaxNameBytes), "missing_file",
                                "The show has neither a GDTF file that can be read nor photometry for this fixture.");
    return profile;
}

Result<std::shared_ptr<const Profile>> beam_profile(ShowImport& import, const gdtf::FixtureType& type,
                                                    const gdtf::Beam& beam, std::optional<Angle> zoom) {
    if (auto measured = photometric_profile(import, type, beam)) return measured;
    const double angle = zoom ? zoom->radians() : beam.beam_angle_rad.value;
    // A geometry that glows needs a surface: without a BeamRadius it has the standard's default.
    const double radius = beam.radius_m.defaulted && !gdtf::glows(beam.type.value) ? 0.0 : beam.radius_m.value;
    const std::string key =
        printed("beam %.9g %.9g %.9g %.9g %.9g %.9g %d ", beam.flux_lm.value, angle,
                beam.field_angle_rad.value / beam.beam_angle_rad.value, radius, beam.throw_ratio.value,
                beam.rectangle_ratio.value, static_cast<int>(beam.type.value)) +
        type.name;
    std::shared_ptr<const Profile>& profile = import.profiles[key];
    if (profile) return profile;
    if (auto full = take_memory(import.room, 1, kBytesOfProfile, type.name)) return *full;
    ies::Photometry photometry;
    photometry.web = gdtf::beam_web(beam, zoom);
    photometry.provenance.format = "GDTF";
    photometry.provenance.absolute = true;
    photometry.provenance.lumens_per_lamp = -1.0;
    photometry.provenance.input_watts = beam.power_w.value;
    for (const auto& [keyword, text] : {std::pair("MANUFAC", type.manufacturer), {"LUMINAIRE", type.name}})
        if (!text.empty()) photometry.provenance.keywords.emplace_back(keyword, text);
    if (radius > 0.0) photometry.opening = {ies::OpeningShape::ellipse, 2.0 * radius * m, 2.0 * radius * m, 0.0 * m};
    profile = make_profile(shortened_text(type.name, kMaxNameBytes), std::move(photometry));
    tables_of(*profile);
    return profile;
}

// Turns the aim (-Z) to the direction by the shortest way.
glm::dquat aimed_at(const glm::dquat& turn, const glm::dvec3& direction) {
    const glm::dvec3 from = turn * glm::dvec3(0, 0, -1), to = glm::normalize(direction);
    const double cosine = glm::dot(from, to);
    if (cosine < -1.0 + 1e-9) return glm::angleAxis(std::numbers::pi, turn * glm::dvec3(0, 1, 0)) * turn;
    return glm::normalize(glm::normalize(glm::dquat(1.0 + cosine, glm::cross(from, to))) * turn);
}

// "Yoke_Pan.Pan.Pan 1,f 45.0": Vectorworks writes a fixture's aim so, in degrees.
std::optional<double> command_rad(const mvr::Fixture& fixture, const char* attribute) {
    for (const std::string& command : fixture.commands) {
        const std::size_t comma = command.find(",f ");
        if (comma == std::string::npos || command.find(std::string(".") + attribute + ".") > comma) continue;
        if (const auto value = number_of(std::string_view(command).substr(comma + 3)); value && std::abs(*value) <= 720)
            return *value * kDegree;
    }
    return std::nullopt;
}

// Emitters that all are dark by default light nothing until a console speaks: then all are on.
void light_emitters(const gdtf::Mode& mode, std::vector<gdtf::ChannelValue>& values) {
    const bool by_rgb = gdtf::mix_by_rgb(mode);
    const auto function_of = [&](const gdtf::ChannelValue& value) -> const gdtf::ChannelFunction* {
        if (value.function < 0) return nullptr;
        const gdtf::PatchedChannel& patched = mode.patched[static_cast<std::size_t>(value.patched)];
        const auto& functions = mode.channels[static_cast<std::size_t>(patched.channel)].functions;
        const auto& function = functions[static_cast<std::size_t>(value.function)];
        return gdtf::adds_light(function.attribute, by_rgb) ? &function : nullptr;
    };
    for (const gdtf::ChannelValue& value : values)
        if (const auto* function = function_of(value); function && value.physical > function->physical_from) return;
    for (gdtf::ChannelValue& value : values)
        if (const auto* function = function_of(value)) value.physical = function->physical_to;
}

// Result: the colour that makes `color` beside the white. Of a channel that the white lacks it is 1: a lamp below some
// 1,900 K has no blue.
glm::dvec3 beside_white(const glm::dvec3& color, double white_k) {
    const glm::dvec3 white = white_factors(white_k, 0.0);
    glm::dvec3 beside(1.0);
    for (int i = 0; i < 3; ++i)
        if (white[i] > 0.0) beside[i] = color[i] / white[i];
    return beside;
}

// As it was when Gonio wrote the show.
void take_state(LightSeed& light, const mvr::Fixture& fixture) {
    if (!fixture.state) return;
    light.level_ratio = fixture.state->level_ratio;
    light.multiplier = fixture.state->multiplier;
    light.color = {fixture.state->color[0], fixture.state->color[1], fixture.state->color[2]};
    light.cct_k = 0.0;  // its white is in the colour
}

struct Placed {
    const mvr::Fixture& fixture;
    const mvr::Object& object;
    std::string name;
    glm::dmat4 world_from_fixture;  // of Z up
};

// Where a head stands that a console swings.
struct Swing {
    HeadAxes axes;
    double pan_rad, tilt_rad;  // of GDTF
};

// Angles with which the head's console would bring about the light's orientation; where a focus point has turned it,
// only its aim, since a head does not roll.
void take_swing(LightSeed& light, const glm::dquat& home, const Swing& swing) {
    const HeadAxes& axes = swing.axes;
    const glm::dquat mount_from_world = glm::inverse(axes.world_from_mount);
    const double pan_rad = axes.pan_offset_rad + axes.pan_sign * swing.pan_rad;
    const double tilt_rad = axes.tilt_offset_rad + axes.tilt_sign * swing.tilt_rad;
    PanTiltRoll angles{pan_rad, tilt_rad, roll_of(mount_from_world * home, pan_rad, tilt_rad)};
    light.world_from_mount = axes.world_from_mount;
    if (light.world_from_light != home) {
        const PanTiltRoll aim = angles_of(mount_from_world * light.world_from_light);
        const bool far = std::cos(aim.pan_rad - pan_rad) < 0.0;  // of the two ways there the one that is nearer in pan
        if (aim.tilt_rad > 1e-6) angles.pan_rad = aim.pan_rad + (far ? std::numbers::pi : 0.0);
        angles.tilt_rad = far ? -aim.tilt_rad : aim.tilt_rad;
        light.world_from_light = glm::normalize(axes.world_from_mount * orientation_of(angles));
    }
    light.angles = angles;
}

// Result: whether it is there.
bool finish_light(ShowImport& import, const Placed& placed, LightSeed light, const glm::dmat4& world_from_beam,
                  const std::optional<Swing>& swing) {
    light.position = glm::dvec3(world_from_beam[3]);
    const glm::dquat home = turn_of(world_from_beam);
    light.world_from_light = home;
    const glm::dquat& turn = light.world_from_light;
    if (!is_within(light.position) || !std::isfinite(turn.w + turn.x + turn.y + turn.z)) {
        import.report.add(Outcome::left_out, "a light is more than 1,000 km away, or its axes span no space",
                          light.name);
        return false;
    }
    if (placed.fixture.focus >= 0) {
        const glm::dvec3 to =
            import.show.focus_points[static_cast<std::size_t>(placed.fixture.focus)].position - light.position;
        if (glm::length(to) > 1e-6) light.world_from_light = aimed_at(home, to);
    }
    if (swing) take_swing(light, home, *swing);
    import.scene.lights.push_back(std::move(light));
    return true;
}

bool has_room(ShowImport& import, const std::string& name) {
    if (import.scene.lights.size() < kMaxLights) return true;
    import.report.add(Outcome::left_out, "a light beyond the " + std::to_string(kMaxLights) + " of a scene", name);
    return false;
}

std::optional<Error> add_beams(ShowImport& import, const Placed& placed, const gdtf::FixtureType& type,
                               const std::shared_ptr<const Profile>& paired) {
    const auto found = gdtf::find_mode(type, placed.fixture.mode);
    if (!found.as_named) import.report.add(Outcome::guessed, "a fixture's mode is the first of its type", placed.name);
    const gdtf::Mode& mode = type.modes[found.index];
    if (!index_of(import, mode).has_beam) {
        const char* const why = gdtf::why_dark(type, mode);
        import.report.add(Outcome::left_out, why != nullptr ? why : "a fixture has no beam", placed.name);
        return std::nullopt;
    }
    if (!has_room(import, placed.name)) return std::nullopt;
    auto values = gdtf::default_values(type, mode);
    light_emitters(mode, values);
    gdtf::StateOptions options{placed.fixture.invert_pan, placed.fixture.invert_tilt, 0.0, 0.0};
    const auto pan = command_rad(placed.fixture, "Pan"), tilt = command_rad(placed.fixture, "Tilt");
    if (pan || tilt) {
        if (pan.value_or(0.0) != 0.0 || tilt.value_or(0.0) != 0.0)
            import.report.add(Outcome::guessed, "pan and tilt are those of custom commands, in degrees", placed.name);
        options.pan_rad = pan.value_or(0.0);
        options.tilt_rad = tilt.value_or(0.0);
    }
    const auto states = gdtf::beam_states(type, mode, values, options);
    const bool alone = states.size() == 1 || paired;
    if (states.size() > 1 && paired)
        import.report.add(Outcome::guessed, "photometry of a fixture with several beams is that of all: one light",
                          placed.name);
    std::vector<BodyLight> lights;
    for (const gdtf::BeamState& state : states) {
        if (paired && &state != &states.front()) break;
        const gdtf::Geometry& geometry = mode.geometries[static_cast<std::size_t>(state.geometry)];
        if (geometry.beam->guessed && !paired)
            import.report.add(Outcome::guessed,
                              "a fixture's type has no beam: GDTF's default one, along -Z of its innermost geometry",
                              placed.name);
        const std::string wanted = alone ? placed.name : placed.name + " " + geometry.name;
        if (!has_room(import, wanted)) continue;
        LightSeed light;
        light.name = unique_name(import, wanted);
        light.profile = paired;
        if (!paired) {
            const auto zoom = state.zoom_rad ? std::optional(Angle::radians(*state.zoom_rad)) : std::nullopt;
            auto profile = beam_profile(import, type, *geometry.beam, zoom);
            if (!profile) return profile.error();
            light.profile = *profile;
        }
        const double most = std::max({state.color.r, state.color.g, state.color.b});
        light.cct_k = state.white_k;
        light.color = most > 1e-3 ? beside_white(state.color, state.white_k) : glm::dvec3(1.0);
        const FixtureBeam beam{placed.fixture, type, mode, state.geometry, placed.world_from_fixture, light.name};
        if (placed.fixture.gobo.empty())
            light.profile =
                with_gobos(import, light.profile, type, gobo_channel(import, index_of(import, mode), beam).wheel);
        else
            light.profile = with_own_gobo(import, light.profile, placed.fixture);
        glm::dmat4 world_from_beam = placed.world_from_fixture * state.fixture_from_beam;
        const auto axes = add_patch_rows(import, beam);
        take_state(light, placed.fixture);
        const bool swings = axes && geometry.parent >= 0;
        if (swings && states.size() > 1)
            import.report.add(Outcome::guessed, "several beams of a head that swings stay where they are at home",
                              light.name);
        if (swings && states.size() == 1) {
            // A head that a console swings: the light stands where its axes meet, so that the aim stays true.
            const glm::dmat4 fixture_from_head = state.fixture_from_beam * glm::inverse(geometry.parent_from_geometry);
            world_from_beam[3] = placed.world_from_fixture * fixture_from_head[3];
        }
        const auto swing = axes ? std::optional(Swing{*axes, *options.pan_rad, *options.tilt_rad}) : std::nullopt;
        if (!finish_light(import, placed, std::move(light), world_from_beam, swing)) continue;
        note_imported(import, placed.fixture, alone ? "" : geometry.name);
        lights.push_back({state.geometry, import.scene.lights.size() - 1, turn_of(world_from_beam), axes});
    }
    const double pan_rad = options.pan_rad.value_or(0.0) * (options.invert_pan ? -1.0 : 1.0);
    add_body(import, {type, mode, placed.world_from_fixture, pan_rad, placed.name}, lights);
    return std::nullopt;
}

}  // namespace

glm::dquat turn_of(const glm::dmat4& matrix) {
    const glm::dvec3 z = glm::normalize(glm::dvec3(matrix[2]));
    const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(matrix[1]), z));
    return glm::normalize(glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z)));
}

std::optional<Error> import_fixtures(ShowImport& import) {
    for (const mvr::Fixture& fixture : import.show.fixtures) {
        const mvr::Object& object = import.show.objects[static_cast<std::size_t>(fixture.object)];
        Placed placed{fixture, object, object.name, object.world_from_object * y_up_from_z_up()};
        const bool own = import.show.provider == mvr::kProvider;  // its lights have names of their own
        if (!own && !fixture.fixture_id.empty() && fixture.fixture_id != "0") placed.name += " " + fixture.fixture_id;
        const gdtf::FixtureType* type = fixture.entry.empty() ? nullptr : type_of(import, fixture.entry);
        const auto paired = paired_profile(import, fixture, object.name);
        if (type != nullptr) {
            if (auto error = add_beams(import, placed, *type, paired)) return error;
        } else {
            if (!has_room(import, placed.name)) continue;
            LightSeed light;
            light.name = unique_name(import, placed.name);
            light.profile =
                paired ? with_own_gobo(import, paired, fixture) : dark_profile(import, fixture, placed.name);
            take_state(light, fixture);
            if (finish_light(import, placed, std::move(light), placed.world_from_fixture, std::nullopt))
                note_imported(import, fixture, "");
        }
    }
    note_undriven(import);
    if (std::ranges::any_of(import.show.fixtures, [](const mvr::Fixture& fixture) { return !fixture.state; }) &&
        !import.scene.lights.empty())
        import.report.add(Outcome::defaulted, "lights are at full level until a console says otherwise");
    return std::nullopt;
}

}  // namespace gonio::exchange
