// What scripts read from gonio, and the program as a whole against a front played by the test.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/cli/cli.h"
#include "client/cli/output.h"
#include "client/connection/connection.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/report.pb.h"
#include "protocol/schema/scene.pb.h"
#include "protocol/schema/session.pb.h"
#include "protocol/schema/state.pb.h"
#include "server/http/http_server.h"

namespace gonio {
namespace {

v1::State example_state() {
    v1::State state;
    state.set_scene_rev(7);
    state.set_scene("cornell");
    for (const char* name : {"key", "key.left"}) {
        v1::Light* light = state.add_lights();
        light->set_name(name);
        light->set_level_ratio(0.5);
        for (const double x : {0.0, -1.0, 0.25}) light->add_aim(x);
    }
    state.mutable_camera()->set_fov_rad(0.7);
    state.mutable_saved_views()->add_views()->set_name("door");
    state.mutable_grids()->add_grids()->set_name("desk");
    state.mutable_observers()->add_observers()->set_name("seat");
    return state;
}

TEST(CliOutput, PathsLeadToParts) {
    const v1::State state = example_state();
    const auto at = [&](const char* path) {
        const auto json = json_at(state, path, true);
        return json ? *json : json.error().code + " " + json.error().value;
    };
    EXPECT_EQ(at("scene_rev"), "7");
    EXPECT_EQ(at("scene"), "\"cornell\"");
    EXPECT_EQ(at("camera.fov_rad"), "0.7");
    EXPECT_EQ(at("lights[0].aim"), "[0,-1,0.25]");
    EXPECT_EQ(at("lights[0].aim[2]"), "0.25");
    EXPECT_EQ(at("lights.key.level_ratio"), "0.5");
    EXPECT_EQ(at("lights.key.left.name"), "\"key.left\"");
    EXPECT_EQ(at("lights[key.left].name"), "\"key.left\"");
    EXPECT_EQ(at("lights[2]"), "not_found [2]");
    EXPECT_EQ(at("lights.none.aim"), "not_found .none.aim");
    EXPECT_EQ(at("camera.fov_rad.x"), "not_found .x");
    EXPECT_EQ(at("lights[0"), "not_found [0");
    EXPECT_NE(at("").find("\"scene_rev\":7"), std::string::npos);
    EXPECT_EQ(*json_at(state, "camera", false), "{\n  \"eye\": [],\n  \"target\": [],\n  \"fov_rad\": 0.7\n}");
    EXPECT_EQ(*json_at(state, "lights[0].aim", false), "[0,-1,0.25]");
}

TEST(CliOutput, SharedPassesHaveANullLight) {
    v1::FrameReport report;
    report.set_scene_rev(3);
    report.set_frame_ms(12.5);
    report.add_passes()->set_name("composite");
    v1::PassReport* shadow = report.add_passes();
    shadow->set_name("shadow");
    shadow->set_light("key");
    shadow->set_state("ran");
    shadow->set_faces(6);
    const std::string json = to_json(report, true);
    EXPECT_EQ(json,
              R"({"scene_rev":3,"frame_ms":12.5,"settled":false,"passes":[{"name":"composite","state":"","faces":0,)"
              R"("cpu_ms":0,"gpu_ms":0,"draws":0,"light":null},{"name":"shadow","state":"ran","faces":6,)"
              R"("cpu_ms":0,"gpu_ms":0,"draws":0,"light":"key"}],)"
              R"("width_px":0,"height_px":0,"effort":0,"vpls":0,"refined_rounds":0,"samples_per_pixel":0,"links":0})");
    EXPECT_NE(report_table(report).find("shadow"), std::string::npos);
    v1::CaptureResult capture;
    capture.set_image("bytes");
    *capture.mutable_report() = report;
    const std::string without_image = to_json(capture, true);
    EXPECT_EQ(without_image.find("image"), std::string::npos);
    EXPECT_NE(without_image.find("\"light\":null"), std::string::npos);
}

TEST(CliOutput, ProgressInOneLine) {
    v1::Progress progress;
    progress.set_jobs_before(1);
    EXPECT_EQ(progress_line(progress), "waiting: 1 job comes first");
    progress.set_jobs_before(3);
    EXPECT_EQ(progress_line(progress), "waiting: 3 jobs come first");
    progress.set_jobs_before(0);
    progress.set_seconds(12.4);
    progress.set_samples(64);
    EXPECT_EQ(progress_line(progress), "12 s  64 done");
    progress.set_unit("tiles");
    progress.set_total(200);
    EXPECT_EQ(progress_line(progress), "[######..............]  32 %  12 s  64 of 200 tiles");
    progress.set_unit("samples");
    progress.clear_total();
    progress.set_noise_ratio(0.0123);
    EXPECT_EQ(progress_line(progress), "12 s  64 samples  noise 1.23 %");
    progress.set_seconds_left(30.2);
    EXPECT_EQ(progress_line(progress), "[#####...............]  29 %  12 s  64 samples  noise 1.23 %  30 s left");
    progress.set_seconds_left(3600);
    EXPECT_EQ(progress_line(progress), "[....................]   0 %  12 s  64 samples  noise 1.23 %  60 min left");
    progress.set_seconds_left(7200);
    progress.set_total(64);
    EXPECT_EQ(progress_line(progress), "[####################] 100 %  12 s  64 of 64 samples  noise 1.23 %  2 h left");
}

TEST(CliOutput, PresetsAndViewsAsTables) {
    v1::State state;
    for (const char* name : {"warm", "the long name"}) state.mutable_presets()->add_names(name);
    state.mutable_presets()->set_recalled("warm");
    EXPECT_EQ(presets_table(state),
              "preset         recalled last\n"
              "warm           yes\n"
              "the long name\n");
    v1::SavedView& view = *state.mutable_saved_views()->add_views();
    view.set_name("from the door");
    for (const double x : {0.0, 1.5, 7.75}) view.mutable_camera()->add_eye(x);
    for (const double x : {0.0, 1.0, -2.0}) view.mutable_camera()->add_target(x);
    view.mutable_camera()->set_fov_rad(0.5);
    EXPECT_EQ(views_table(state),
              "view           eye, m      target, m  field of view\n"
              "from the door  0,1.5,7.75  0,1,-2     28.6°\n");
}

TEST(CliOutput, ServerUrls) {
    const auto parsed = [](const char* url) {
        const auto address = parse_server_url(url);
        return address ? address->host + " " + address->port : address.error().code;
    };
    EXPECT_EQ(parsed("http://127.0.0.1:8080"), "127.0.0.1 8080");
    EXPECT_EQ(parsed("http://host:81/"), "host 81");
    EXPECT_EQ(parsed("host"), "host 8080");
    EXPECT_EQ(parsed("http://[::1]:9"), "::1 9");
    EXPECT_EQ(parsed("https://host"), "host 443");
    EXPECT_TRUE(parse_server_url("https://host:8443")->secure);
    EXPECT_FALSE(parse_server_url("host:443")->secure);
    EXPECT_EQ(parse_server_url("host")->url(), "http://host:8080");
    EXPECT_EQ(parse_server_url("wss://[::1]/")->url(), "https://[::1]:443");
    for (const char* bad :
         {"ftp://x", "http://", "http://x:", "x:99999999", "x:65536", "x:0", "x:port", "[::1", "http://host/viewer",
          "http://user:secret@host", "http://host?token=secret", "http://host/#secret"})
        EXPECT_EQ(parsed(bad), "usage") << bad;
}

// A daemon that knows one light and answers at once.
struct CliRun : testing::Test {
    std::unique_ptr<HttpServer> front;
    std::string out, err;
    std::atomic<std::uint32_t> rev = 7;

    void SetUp() override {
        HttpOptions options;
        options.port = 0;
        HttpServer::Callbacks callbacks;
        callbacks.request = [this](SessionId session, v1::ClientMessage message) {
            answer(session, message);
            return true;
        };
        callbacks.demand = [this](Demand demand) {
            if (!demand.h264() || !front) return;
            EncodedFrame frame;
            frame.data.assign(10, std::byte{0x42});
            frame.key = demand.key();
            frame.scene_rev = rev;
            front->publish_h264(std::move(frame), true);
        };
        auto started = HttpServer::start(options, std::move(callbacks));
        ASSERT_TRUE(started);
        front = std::move(*started);
        front->publish_state(example_state());
    }
    void answer(SessionId session, const v1::ClientMessage& message) {
        v1::ServerMessage reply;
        reply.set_request_id(message.request_id());
        if (message.has_get_state()) *reply.mutable_state() = example_state();
        if (message.meter().quality() == "reference") {
            v1::ServerMessage news;
            news.mutable_progress()->set_request(message.request_id());
            front->reply(session, news);
        }
        if (message.meter().count_size() > 0) {
            reply.mutable_meter_grid()->add_points()->set_total_lx(100);
            reply.mutable_meter_grid()->set_uniformity_ratio(0.5);
        } else if (message.has_pick()) {
            reply.mutable_pick()->set_hit(message.pick().x() == 0.5 && message.pick().y() == 0.25);
        } else if (message.has_meter()) {
            reply.mutable_meter()->set_total_lx(250);
        }
        if (message.has_grid()) {
            v1::GridValues& values = *reply.mutable_grid_values();
            values.mutable_grid()->set_name(message.grid().name());
            values.mutable_grid()->set_maintenance_factor(0.8);
            values.add_count(2);
            values.add_count(1);
            for (const double cell : {0.5, 1.0}) values.add_cell_m(cell);
            for (const double x : {0.25, 0.75, 0.5, 0.75, 0.75, 0.5}) values.add_points_m(x);
            for (const double lx : {480.0, 560.5}) values.add_values_lx(lx);
            values.set_mean_lx(520.25);
            values.set_max_lx(560.5);
            v1::LeftOutPoint& point = *values.add_left_out();
            point.set_point(1);
            point.set_reason("inside");
            values.add_warnings("a warning of the grid");
            v1::TargetCheck& check = *values.add_checks();
            check.set_name("Em");
            check.set_required(750);
            check.set_reached(520.25);
        }
        if (message.has_ugr()) {
            reply.mutable_ugr()->set_ugr(18.44);
            reply.mutable_ugr()->add_sources()->set_left_out("behind the eye");
            reply.mutable_ugr()->add_warnings("no sun");
        }
        if (message.has_targets()) reply.mutable_targets()->add_targets()->set_name("office-writing");
        if (message.has_lux_report()) {
            reply.mutable_lux_report()->set_html("<!DOCTYPE html>" + message.lux_report().title());
            reply.mutable_lux_report()->set_scene_rev(7);
        }
        if (message.has_stats()) reply.mutable_stats()->set_frames_rendered(3);
        if (message.has_report()) {
            reply.mutable_report()->set_scene_rev(message.report().rev());
            reply.mutable_report()->add_passes()->set_name("gbuffer");
        }
        if (message.has_capture()) {
            reply.mutable_capture()->set_format(message.capture().format());
            reply.mutable_capture()->set_image("picture");
            reply.mutable_capture()->set_width_px(message.capture().width_px());
        }
        if (message.has_command()) {
            v1::Result& result = *reply.mutable_result();
            if (message.command().has_set_light() && message.command().set_light().name() != "key") {
                result.set_code("unknown_light");
                result.set_field("set_light.name");
                result.set_value(message.command().set_light().name());
                result.set_message("There is no such light.");
            } else {
                result.set_code("ok");
                result.set_scene_rev(++rev);
                if (message.command().has_load_scene()) {
                    result.set_replaced("atrium: 3 luminaires; not saved");
                    result.add_notes("taken: fixture: \"Spot 1\"");
                    result.add_warnings("left out: a fixture is not patched");
                }
            }
        }
        front->reply(session, reply);
    }
    int run(std::vector<std::string> args, bool with_server = true) {
        if (with_server) {
            args.insert(args.begin(), "http://127.0.0.1:" + std::to_string(front->port()));
            args.insert(args.begin(), "--server");
        }
        std::ostringstream out_stream, err_stream;
        const int code = run_cli(args, out_stream, err_stream);
        out = out_stream.str();
        err = err_stream.str();
        return code;
    }
};

TEST_F(CliRun, ChangesPrintTheirRevision) {
    EXPECT_EQ(run({"set", "light", "key", "--level", "0.5"}), 0);
    EXPECT_EQ(out, "scene_rev 8\n");
    EXPECT_EQ(run({"--json", "set", "exposure", "-2"}), 0);
    EXPECT_EQ(
        out,
        R"({"code":"ok","field":"","value":"","message":"","scene_rev":9,"warnings":[],"retry_after_ms":0,"notes":[]})"
        "\n");
    EXPECT_EQ(run({"group", "all", "key", "--json"}), 0);
    EXPECT_NE(out.find("\"scene_rev\":10"), std::string::npos);
}

TEST_F(CliRun, ALoadTellsWhatItReplacedAndUnderstood) {
    EXPECT_EQ(run({"load", "scene", "cornell"}), 0) << err;
    EXPECT_EQ(out,
              "scene_rev 8\nreplaced atrium: 3 luminaires; not saved (gonio undo brings it back)\n"
              "taken: fixture: \"Spot 1\"\n");
    EXPECT_EQ(err, "warning: left out: a fixture is not patched\n") << "what was understood is no warning";
}

TEST_F(CliRun, ListsAreTables) {
    EXPECT_EQ(run({"light", "list"}), 0) << err;
    EXPECT_EQ(out.rfind("light  ", 0), 0u) << out;
    EXPECT_NE(out.find("\nkey "), std::string::npos) << out;
    EXPECT_EQ(run({"light", "list", "--json"}), 0) << err;
    EXPECT_EQ(out.rfind("{\"lights\":[{\"name\":\"key\"", 0), 0u) << out;
    EXPECT_EQ(run({"group", "list"}), 0) << err;
    EXPECT_EQ(out.rfind("group", 0), 0u) << "it lists, and makes no group of this name: " << out;
    EXPECT_EQ(run({"group", "--", "list", "key"}), 0) << err;
    EXPECT_EQ(out, "scene_rev 8\n");
}

TEST_F(CliRun, HelpAndVersionAreCommandsToo) {
    EXPECT_EQ(run({"help"}, false), 0);
    const std::string all = out;
    EXPECT_EQ(run({"--help"}, false), 0);
    EXPECT_EQ(out, all);
    EXPECT_EQ(run({"help", "set", "light"}, false), 0);
    const std::string one = out;
    EXPECT_EQ(run({"set", "light", "--help"}, false), 0);
    EXPECT_EQ(out, one);
    EXPECT_EQ(run({"help", "set"}, false), 0);
    EXPECT_NE(out.find("set camera"), std::string::npos) << out;
    EXPECT_EQ(run({"help", "fly"}, false), 2);
    EXPECT_NE(err.find("There is no such command."), std::string::npos) << err;
    EXPECT_EQ(run({"version"}, false), 0);
    EXPECT_EQ(out.rfind("gonio ", 0), 0u) << out;
}

TEST_F(CliRun, RefusalsSayCodeFieldAndValue) {
    EXPECT_EQ(run({"set", "light", "moon", "--level", "0.5"}), 1);
    EXPECT_EQ(out, "");
    EXPECT_EQ(err, "gonio: unknown_light set_light.name moon: There is no such light.\n");
    EXPECT_EQ(run({"--json", "set", "light", "moon", "--level", "0.5"}), 1);
    EXPECT_NE(out.find("\"code\":\"unknown_light\""), std::string::npos) << out;
}

TEST_F(CliRun, Queries) {
    EXPECT_EQ(run({"get", "lights.key.aim", "--json"}), 0);
    EXPECT_EQ(out, "[0,-1,0.25]\n");
    EXPECT_EQ(run({"get", "nothing"}), 1);
    EXPECT_EQ(run({"view", "list"}), 0);
    EXPECT_NE(out.find("\ndoor  "), std::string::npos) << out;
    EXPECT_EQ(run({"view", "list", "--json"}), 0);
    EXPECT_NE(out.find("\"name\":\"door\""), std::string::npos) << out;
    EXPECT_EQ(run({"meter", "--point", "0,0,0", "--normal", "0,1,0", "--json"}), 0);
    EXPECT_NE(out.find("\"total_lx\":250"), std::string::npos);
    EXPECT_EQ(run({"meter", "--point", "0,0,0"}), 2);
    // Progress is no answer, and shown on terminals only.
    EXPECT_EQ(run({"meter", "--point", "0,0,0", "--normal", "0,1,0", "--quality", "reference", "--json"}), 0);
    EXPECT_NE(out.find("\"total_lx\":250"), std::string::npos);
    EXPECT_EQ(err, "");
    EXPECT_EQ(run({"meter", "--point", "0,0,0", "--normal", "0,1,0", "--u", "1,0,0", "--v", "0,0,1", "--count", "1x1",
                   "--json"}),
              0);
    EXPECT_NE(out.find("\"points\":[{"), std::string::npos);
    EXPECT_NE(out.find("\"uniformity_ratio\":0.5"), std::string::npos);
    EXPECT_EQ(run({"pick", "0.5", "25%", "--json"}), 0) << err;
    EXPECT_NE(out.find("\"hit\":true"), std::string::npos) << out;
    EXPECT_EQ(run({"pick", "0.5"}), 2);
    EXPECT_EQ(run({"stats"}), 0);
    EXPECT_NE(out.find("\"frames_rendered\": 3"), std::string::npos);
    EXPECT_EQ(run({"report", "--rev", "12", "--table"}), 0);
    EXPECT_EQ(out.rfind("scene_rev 12", 0), 0u);
    EXPECT_EQ(run({"report", "--rev", "12", "--json"}), 0);
    EXPECT_NE(out.find("\"scene_rev\":12"), std::string::npos);
    EXPECT_NE(out.find("\"light\":null"), std::string::npos);
}

TEST_F(CliRun, GridsGlareAndTheReport) {
    EXPECT_EQ(run({"grid", "list"}), 0) << err;
    EXPECT_EQ(out.rfind("desk  ", 0), 0u) << out;
    EXPECT_EQ(run({"observer", "list", "--json"}), 0) << err;
    EXPECT_NE(out.find("\"name\":\"seat\""), std::string::npos) << out;
    EXPECT_EQ(run({"grid", "values", "desk"}), 0) << err;
    EXPECT_NE(out.find("Emean 520.2 lx"), std::string::npos) << out;
    EXPECT_NE(out.find("FAIL Em: 520.2, required at least 750"), std::string::npos) << out;
    EXPECT_NE(out.find("maintenance factor 0.8"), std::string::npos) << out;
    EXPECT_NE(out.find(" 480   -\n"), std::string::npos) << "the plan: " << out;
    EXPECT_NE(out.find("1 points left out: they lie inside closed bodies\n"), std::string::npos) << out;
    EXPECT_NE(err.find("a warning of the grid"), std::string::npos) << err;
    EXPECT_EQ(run({"grid", "values", "desk", "--csv"}), 0) << err;
    EXPECT_EQ(out, "i,j,x_m,y_m,z_m,lx,left_out\n0,0,0.25,0.75,0.5,480,\n1,0,0.75,0.75,0.5,560.5,inside\n");
    EXPECT_EQ(run({"grid", "values", "desk", "--csv", "--json"}), 2);
    EXPECT_EQ(run({"grid", "values", "desk", "--json"}), 0) << err;
    EXPECT_NE(out.find("\"mean_lx\":520.25"), std::string::npos) << out;
    EXPECT_EQ(run({"ugr", "--eye", "0,1.2,0", "--direction", "0,0,-1"}), 0) << err;
    EXPECT_EQ(out.rfind("UGR 18.4\n", 0), 0u) << out;
    EXPECT_NE(out.find("left out: behind the eye"), std::string::npos) << out;
    EXPECT_EQ(err, "warning: no sun\n");
    EXPECT_EQ(run({"targets"}), 0) << err;
    EXPECT_NE(out.find("office-writing"), std::string::npos) << out;
    const std::string file = testing::TempDir() + "lux-report.html";
    EXPECT_EQ(run({"lux-report", file, "--title", "Room 12"}), 0) << err;
    EXPECT_EQ(out, file + " scene_rev 7\n");
    std::ifstream written(file);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(written), {}), "<!DOCTYPE html>Room 12");
}

TEST_F(CliRun, CapturesAreWrittenWhole) {
    const auto folder = std::filesystem::temp_directory_path() / "gonio_capture_test";
    std::filesystem::create_directories(folder);
    const auto path = folder / "out.PNG";
    EXPECT_EQ(run({"capture", path.string(), "--size", "64x32"}), 0) << err;
    std::ifstream file(path);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "picture");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
    EXPECT_EQ(run({"capture", (folder / "out.gif").string()}), 2);
    EXPECT_EQ(run({"capture", (folder / "no" / "out.png").string()}), 2);
    const std::string scene = (folder / "out.GLB").string();
    EXPECT_EQ(run({"save", "scene", scene}), 0) << err;
    EXPECT_EQ(out, scene + " 7 bytes scene_rev 0\n");
    EXPECT_TRUE(std::filesystem::exists(scene));
    EXPECT_EQ(run({"save", "scene", (folder / "out.mvr").string()}), 0) << err;
    EXPECT_EQ(run({"save", "scene", (folder / "out.png").string()}), 2);
    EXPECT_EQ(run({"save", "scene", (folder / "no" / "out.glb").string()}), 2) << "as of a full disk";
    std::filesystem::remove_all(folder);
}

TEST_F(CliRun, WatchStopsAfterItsFrames) {
    const auto path = std::filesystem::temp_directory_path() / "gonio_watch_test.h264";
    EXPECT_EQ(run({"watch", "--frames", "3", "--out", path.string()}), 0) << err;
    EXPECT_EQ(std::count(out.begin(), out.end(), '\n'), 3) << out;
    EXPECT_NE(out.find("{\"frame\":{\"seq\":1,\"scene_rev\":7,\"key\":true"), std::string::npos);
    EXPECT_EQ(std::filesystem::file_size(path), 30u);
    std::filesystem::remove(path);
}

TEST_F(CliRun, UsageAndUnreachable) {
    EXPECT_EQ(run({"fly"}), 2);
    EXPECT_EQ(run({"set", "light", "key", "--level", "high"}), 2);
    EXPECT_NE(err.find("--level high"), std::string::npos);
    EXPECT_EQ(run({}, false), 2);
    EXPECT_EQ(run({"--help"}, false), 0);
    EXPECT_NE(out.find("meter --point"), std::string::npos);
    EXPECT_EQ(run({"--server", "http://127.0.0.1:1", "stats"}, false), 3);
    EXPECT_EQ(run({"--server", "ftp://x", "stats"}, false), 2);
    EXPECT_EQ(run({"--token-file", "/nonexistent", "stats"}), 2);
}

}  // namespace
}  // namespace gonio
