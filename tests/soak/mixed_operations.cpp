#include "tests/soak/mixed_operations.h"

#include <numbers>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "protocol/schema/cue.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/library.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/show.pb.h"
#include "protocol/schema/view.pb.h"
#include "server/scene/scene.h"
#include "tests/e2e/daemon_process.h"
#include "tests/e2e/largest_files.h"

namespace gonio::soak {
namespace {

using Message = v1::ClientMessage;
constexpr double kPi = std::numbers::pi;

// Of repeated fields: positions, directions and colours.
template <typename Field>
void put(Field* field, std::initializer_list<double> values) {
    for (const double value : values) field->Add(value);
}

v1::SetLight& of_light(Draw& draw, Message& message) {
    v1::SetLight& set = *message.mutable_command()->mutable_set_light();
    set.set_name(draw.light());
    return set;
}

void put_place(Draw& draw, v1::SetLight& set) {
    put(set.mutable_position_m(), {draw.number(-1, 1), draw.number(1, 3), draw.number(-1, 1)});
}

void put_cue(Draw& draw, v1::CueEdit& cue) {
    cue.set_number(std::to_string(draw.whole(1, 6)));
    cue.set_label("look of the moment");
    cue.set_up_s(draw.number(0, 1));
    cue.set_down_s(draw.number(0, 1));
    if (draw.coin()) cue.set_follow_s(draw.number(0.1, 1));
}

// ---- lights
void move_level(Draw& draw, Message& message) {
    of_light(draw, message).set_level_ratio(draw.number(0, 1));
    message.mutable_command()->set_gesture(static_cast<std::uint32_t>(draw.whole(0, 3)));
}
void aim(Draw& draw, Message& message) {
    v1::SetLight& set = of_light(draw, message);
    set.set_pan_rad(draw.number(-kPi, kPi));
    set.set_tilt_rad(draw.number(-1, 1));
}
void aim_along(Draw& draw, Message& message) {
    put(of_light(draw, message).mutable_aim(), {draw.number(-1, 1), -1, draw.number(-1, 1)});
}
void place(Draw& draw, Message& message) {
    put_place(draw, of_light(draw, message));
}
void colour(Draw& draw, Message& message) {
    put(of_light(draw, message).mutable_color_rgb(), {draw.number(0, 1), draw.number(0, 1), draw.number(0, 1)});
}
void white(Draw& draw, Message& message) {
    v1::SetLight& set = of_light(draw, message);
    set.set_cct_k(draw.number(2000, 8000));
    set.set_tint_duv(draw.number(-0.02, 0.02));
}
void shape(Draw& draw, Message& message) {
    v1::SetLight& set = of_light(draw, message);
    set.set_zoom_rad(draw.coin() ? draw.number(0.2, 1) : 0);
    set.set_shutter_ratio(draw.number(0.5, 1));
}
void strobe(Draw& draw, Message& message) {
    of_light(draw, message).set_strobe_hz(draw.whole(0, 3) == 0 ? draw.number(1, 10) : 0);
}
void opening(Draw& draw, Message& message) {
    of_light(draw, message).set_opening(draw.any({"file", "point", "rect 0.3x0.2", "disc 0.2"}));
}
void profile(Draw& draw, Message& message) {
    of_light(draw, message).mutable_profile()->set_name(draw.any({"narrow_spot", "batwing", "flood", "street"}));
}
void upload_profile(Draw& draw, Message& message) {
    v1::Profile& uploaded = *of_light(draw, message).mutable_profile();
    uploaded.set_name(draw.name("own", 20) + ".ies");
    uploaded.set_photometry(draw.whole(0, 9) == 0 ? test::fine_ies(draw.whole(1000, 20'000))
                                                  : test::isotropic_ies(draw.number(100, 2000)));
}
void add_light(Draw& draw, Message& message) {
    v1::SetLight& added = *message.mutable_command()->mutable_add_light()->mutable_light();
    added.set_name(draw.name("guest", 12));
    added.mutable_profile()->set_name(draw.any({"narrow_spot", "downlight"}));
    put_place(draw, added);
}
void add_like(Draw& draw, Message& message) {
    v1::AddLight& added = *message.mutable_command()->mutable_add_light();
    added.mutable_light()->set_name(draw.name("guest", 12));
    added.set_like(draw.light());
}
void remove_light(Draw& draw, Message& message) {
    message.mutable_command()->mutable_remove_light()->set_name(draw.name("guest", 12));
}
void rename_light(Draw& draw, Message& message) {
    v1::RenameLight& rename = *message.mutable_command()->mutable_rename_light();
    rename.set_name(draw.name("guest", 12));
    rename.set_new_name(draw.name("guest", 12));
}
void edit_lights(Draw& draw, Message& message) {
    v1::EditLights& edit = *message.mutable_command()->mutable_edit_lights();
    edit.add_names(draw.light());
    edit.mutable_same()->set_level_ratio(draw.number(0, 1));
}
void group(Draw& draw, Message& message) {
    v1::SetGroup& set = *message.mutable_command()->mutable_set_group();
    set.set_name(draw.name("group", 3));
    if (draw.whole(0, 3) > 0) set.add_lights(draw.light());
}
void master(Draw& draw, Message& message) {
    message.mutable_command()->mutable_set_master()->set_ratio(draw.number(0.2, 1));
}
// ---- how one looks
void camera(Draw& draw, Message& message) {
    put(message.mutable_command()->mutable_set_camera()->mutable_eye_m(), {draw.number(-1, 1), 2, draw.number(6, 8)});
}
void exposure(Draw& draw, Message& message) {
    v1::SetExposure& set = *message.mutable_command()->mutable_set_exposure();
    draw.coin() ? set.set_ev100(draw.number(3, 8)) : set.set_automatic(true);
}
void view(Draw& draw, Message& message) {
    v1::SetView& set = *message.mutable_command()->mutable_set_view();
    set.set_view(draw.any({"beauty", "direct", "indirect", "illuminance", "luminance", "solid", "mask"}));
    if (!set.view().ends_with("minance")) return;  // the others have no scale of colours
    set.set_isolux(draw.coin());
    set.set_steps(draw.coin() ? 8 : 0);
}
void look(Draw& draw, Message& message) {
    message.mutable_command()->mutable_set_look()->set_tone(draw.any({"knee", "linear", "aces", "agx", "neutral"}));
}
void haze(Draw& draw, Message& message) {
    message.mutable_command()->mutable_set_haze()->set_preset(draw.any({"off", "off", "faint", "show"}));
}
void size(Draw& draw, Message& message) {
    v1::SetSize& set = *message.mutable_command()->mutable_set_size();
    set.set_width_px(draw.any({160u, 128u}));
    set.set_height_px(draw.any({120u, 96u}));
}
void save_view(Draw& draw, Message& message) {
    message.mutable_command()->mutable_save_view()->set_name(draw.name("place", 4));
}
void recall_view(Draw& draw, Message& message) {
    message.mutable_command()->mutable_recall_view()->set_name(draw.name("place", 4));
}
void remove_view(Draw& draw, Message& message) {
    message.mutable_command()->mutable_remove_view()->set_name(draw.name("place", 4));
}
// ---- presets and cues
void save_preset(Draw& draw, Message& message) {
    message.mutable_command()->mutable_save_preset()->set_name(draw.name("look", 5));
}
void recall_preset(Draw& draw, Message& message) {
    message.mutable_command()->mutable_recall_preset()->set_name(draw.name("look", 5));
    message.mutable_command()->mutable_recall_preset()->set_fade_s(draw.coin() ? draw.number(0, 1) : 0);
}
void remove_preset(Draw& draw, Message& message) {
    message.mutable_command()->mutable_remove_preset()->set_name(draw.name("look", 5));
}
void add_cue(Draw& draw, Message& message) {
    put_cue(draw, *message.mutable_command()->mutable_add_cue());
}
void set_cue(Draw& draw, Message& message) {
    put_cue(draw, *message.mutable_command()->mutable_set_cue());
    message.mutable_command()->mutable_set_cue()->set_record(draw.coin());
}
void remove_cue(Draw& draw, Message& message) {
    message.mutable_command()->mutable_remove_cue()->set_number(std::to_string(draw.whole(1, 6)));
}
void play_cue(Draw& draw, Message& message) {
    v1::Command& command = *message.mutable_command();
    switch (draw.whole(0, 4)) {
        case 0:
            return command.mutable_cue_back()->set_time_s(draw.number(0, 1));
        case 1:
            return (void)command.mutable_cue_stop();
        case 2:
            return command.mutable_cue_goto()->set_number(std::to_string(draw.whole(1, 6)));
        default:
            return (void)command.mutable_cue_go();
    }
}
// ---- consoles, grids, observers
void patch(Draw& draw, Message& message) {
    v1::PatchRow& row = *message.mutable_command()->mutable_set_patch()->add_rows();
    row.set_protocol("sacn");
    row.set_universe(static_cast<std::uint32_t>(draw.whole(1, 5)));
    row.set_address(static_cast<std::uint32_t>(draw.whole(1, 500)));
    row.set_target(draw.light());
    row.set_property("level");
}
void set_grid(Draw& draw, Message& message) {
    v1::Grid& grid = *message.mutable_command()->mutable_set_grid()->mutable_grid();
    grid.set_name(draw.name("desk", 3));
    put(grid.mutable_corner_m(), {-0.5, draw.number(0.1, 0.8), -0.5});
    put(grid.mutable_u_m(), {1, 0, 0});
    put(grid.mutable_v_m(), {0, 0, 1});
    grid.add_count(static_cast<std::uint32_t>(draw.whole(2, 5)));
    grid.add_count(3);
}
void remove_grid(Draw& draw, Message& message) {
    message.mutable_command()->mutable_remove_grid()->set_name(draw.name("desk", 3));
}
void set_observer(Draw& draw, Message& message) {
    v1::Observer& observer = *message.mutable_command()->mutable_set_observer()->mutable_observer();
    observer.set_name(draw.name("guest's eye", 2));
    put(observer.mutable_eye_m(), {draw.number(-0.5, 0.5), 1.2, 0.5});
    put(observer.mutable_direction(), {0, 0, -1});
}
// ---- the show as a whole
void undo(Draw&, Message& message) {
    message.mutable_command()->mutable_undo();
}
void redo(Draw&, Message& message) {
    message.mutable_command()->mutable_redo();
}
void load_scene(Draw& draw, Message& message) {
    message.mutable_command()->mutable_load_scene()->set_file(
        draw.any({"cornell", "cylinder", "upload:soak.gltf", "upload:hills.glb"}));
    if (draw.coin()) message.mutable_command()->mutable_load_scene()->add_keep("lights");
}
void save_show(Draw& draw, Message& message) {
    message.mutable_save_show()->set_name(draw.name("evening", 2));
    message.mutable_save_show()->set_replace(true);
}
void open_show(Draw& draw, Message& message) {
    message.mutable_command()->mutable_open_show()->set_name(draw.name("evening", 2));
}
// ---- what is only asked
void get_state(Draw& draw, Message& message) {
    message.mutable_get_state()->set_hash(draw.coin());
}
void meter(Draw& draw, Message& message) {
    v1::MeterQuery& meter = *message.mutable_meter();
    put(meter.mutable_point_m(), {draw.number(-0.5, 0.5), 0.01, draw.number(-0.5, 0.5)});
    put(meter.mutable_normal(), {0, 1, 0});
}
void measure_grid(Draw& draw, Message& message) {
    message.mutable_grid()->set_name(draw.name("desk", 3));
}
void glare(Draw& draw, Message& message) {
    message.mutable_ugr()->set_observer(draw.name("guest's eye", 2));
}
void capture(Draw& draw, Message& message) {
    v1::CaptureQuery& capture = *message.mutable_capture();
    capture.set_format(draw.any({"png", "jpg", "exr"}));
    capture.set_view(draw.any({"beauty", "illuminance"}));
    capture.set_width_px(64);
    capture.set_height_px(48);
    if (draw.whole(0, 4) > 0) return;
    capture.set_quality("reference");
    capture.set_max_seconds(0.5);
}
void pick(Draw& draw, Message& message) {
    message.mutable_pick()->set_x(draw.number(0, 1));
    message.mutable_pick()->set_y(draw.number(0, 1));
}
void beam(Draw& draw, Message& message) {
    message.mutable_beam()->set_light(draw.light());
}
void curves(Draw& draw, Message& message) {
    message.mutable_profile()->set_light(draw.light());
}
void list(Draw& draw, Message& message) {
    switch (draw.whole(0, 7)) {
        case 0:
            return (void)message.mutable_shows();
        case 1:
            return message.mutable_shows()->set_text_of("");
        case 2:
            return (void)message.mutable_gels();
        case 3:
            return (void)message.mutable_sources();
        case 4:
            return (void)message.mutable_patch();
        case 5:
            return (void)message.mutable_targets();
        case 6:
            return (void)message.mutable_library();
        default:
            return (void)message.mutable_stats();
    }
}
void isolux(Draw&, Message& message) {
    message.mutable_isolux();
}

constexpr Operation kOperations[] = {
    {"level", 30, false, "not_found", move_level},
    {"aim", 15, false, "not_found", aim},
    {"aim along", 5, false, "not_found", aim_along},
    {"place", 10, false, "not_found", place},
    {"colour", 10, false, "not_found", colour},
    {"white", 5, false, "not_found", white},
    {"shape", 5, false, "not_found", shape},
    {"strobe", 3, false, "not_found", strobe},
    {"opening", 3, false, "not_found", opening},
    {"profile", 5, true, "not_found", profile},
    {"upload profile", 10, true, "not_found", upload_profile},
    {"add", 8, true, "already_exists", add_light},
    {"add like", 4, false, "already_exists not_found", add_like},
    {"remove", 6, false, "not_found", remove_light},
    {"rename", 4, false, "not_found already_exists", rename_light},
    {"edit", 5, false, "not_found", edit_lights},
    {"group", 3, false, "not_found already_exists", group},
    {"master", 5, false, "", master},
    {"camera", 10, false, "", camera},
    {"exposure", 5, false, "", exposure},
    {"view", 6, false, "", view},
    {"look", 3, false, "", look},
    {"haze", 3, false, "", haze},
    {"size", 1, false, "", size},
    {"save view", 2, false, "", save_view},
    {"recall view", 3, false, "not_found", recall_view},
    {"remove view", 1, false, "not_found", remove_view},
    {"save preset", 5, false, "", save_preset},
    {"recall preset", 6, false, "not_found", recall_preset},
    {"remove preset", 2, false, "not_found", remove_preset},
    {"add cue", 4, false, "already_exists", add_cue},
    {"set cue", 4, false, "not_found", set_cue},
    {"remove cue", 2, false, "not_found", remove_cue},
    {"play cue", 8, false, "not_found too_soon", play_cue},
    {"patch", 3, false, "not_found", patch},
    {"grid", 3, false, "", set_grid},
    {"remove grid", 1, false, "not_found", remove_grid},
    {"observer", 2, false, "", set_observer},
    {"undo", 12, false, "not_found conflict", undo},
    {"redo", 6, false, "not_found conflict", redo},
    {"load scene", 2, true, "not_found", load_scene},
    {"save show", 2, true, "", save_show},
    {"open show", 1, true, "not_found", open_show},
    {"state", 5, false, "", get_state},
    {"meter", 5, true, "", meter},
    {"measure grid", 2, true, "not_found", measure_grid},
    {"glare", 2, true, "not_found", glare},
    {"capture", 4, true, "", capture},
    {"pick", 4, true, "", pick},
    {"beam", 2, true, "not_found", beam},
    {"curves", 2, false, "not_found", curves},
    {"list", 5, true, "", list},
    {"isolux", 2, true, "", isolux},
};

}  // namespace

std::string Draw::light() {
    return lights.empty() ? "nobody" : lights[static_cast<std::size_t>(whole(0, static_cast<int>(lights.size()) - 1))];
}

std::span<const Operation> operations() {
    return kOperations;
}

int next_operation(Draw& draw) {
    int all = 0, at = 0;
    for (const Operation& operation : kOperations) all += operation.weight;
    for (int left = draw.whole(0, all - 1); left >= kOperations[at].weight; ++at) left -= kOperations[at].weight;
    return at;
}

bool is_expected(const Operation& operation, std::string_view code) {
    if (code == "ok" || code == "busy") return true;
    for (std::string_view rest = operation.refusals; !rest.empty();) {
        const std::size_t end = rest.find(' ');
        if (rest.substr(0, end) == code) return true;
        rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
    }
    return false;
}

}  // namespace gonio::soak
