// goniod as a service: stills, TLS, configuration, uploads, metrics, signals; with curl(1), which somebody else wrote.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "server/assets/assets.h"
#include "server/scene/scene.h"
#include "tests/e2e/daemon_process.h"
#include "tests/unit/certificate.h"

namespace gonio::test {
namespace {

using Json = nlohmann::json;

struct Answer {
    int status = 0;
    std::string head, body;
};

// Runs curl. Result: its last answer.
Answer curl(const TemporaryFolder& folder, const std::string& arguments) {
    const std::string body = folder.path("body"), head = folder.path("head");
    std::filesystem::remove(body);
    Answer answer;
    const std::string command = "curl -s -S -o " + body + " -D " + head + " -w '%{http_code}' " + arguments + " > " +
                                folder.path("status") + " 2>>" + folder.path("curl.log");
    [[maybe_unused]] const int ended = std::system(command.c_str());
    const auto text = [](const std::string& path) {
        std::ifstream file(path, std::ios::binary);
        return std::string((std::istreambuf_iterator<char>(file)), {});
    };
    answer.status = std::atoi(text(folder.path("status")).c_str());
    answer.head = text(head);
    answer.body = text(body);
    return answer;
}

std::uint32_t rev_of(const Answer& answer) {
    const std::size_t at = answer.head.find("X-Scene-Rev: ");
    return at == std::string::npos ? 0 : static_cast<std::uint32_t>(std::atoi(answer.head.c_str() + at + 13));
}

double mean_of(const std::string& file) {
    const auto picture = read_picture(file);
    if (!picture) return -1;
    double sum = 0;
    for (const float value : picture->values) sum += static_cast<double>(value);
    return sum / static_cast<double>(picture->values.size());
}

TEST(Operations, AStillAfterARevisionContainsIt) {
    TemporaryFolder folder;
    DaemonProcess daemon(
        {"--renderer", "gl", "--scene", folder.file("floor.gltf", floor_gltf(0.5)), "--size", "64x64"});
    const unsigned now = daemon.json({"get", "scene_rev"}).get<unsigned>();
    // Asked for before the change is there.
    Answer late;
    std::thread asking([&] {
        TemporaryFolder own;
        late = curl(
            own, daemon.url() + "/v1/frame.exr?view=illuminance'&'size=33x33'&'after_rev=" + std::to_string(now + 1));
        std::ofstream(folder.path("late.exr"), std::ios::binary) << late.body;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const Answer before = curl(folder, daemon.url() + "/v1/frame.exr?view=illuminance'&'size=33x33");
    std::ofstream(folder.path("before.exr"), std::ios::binary) << before.body;
    EXPECT_EQ(rev_of(before), now) << "others do not wait";
    EXPECT_EQ(daemon.rev({"set", "light", "lamp", "--level", "0.25"}), now + 1);
    asking.join();
    EXPECT_EQ(late.status, 200) << late.body;
    EXPECT_EQ(rev_of(late), now + 1);
    EXPECT_NEAR(mean_of(folder.path("late.exr")) / mean_of(folder.path("before.exr")), 0.25, 0.01);

    // The same by the command line; a revision that is there already waits for nothing.
    ASSERT_EQ(daemon
                  .gonio({"capture", folder.path("after.exr"), "--view", "illuminance", "--size", "33x33",
                          "--after-rev", std::to_string(now + 1)})
                  .exit_code,
              0);
    EXPECT_NEAR(mean_of(folder.path("after.exr")) / mean_of(folder.path("before.exr")), 0.25, 0.01);
    for (const char* kind : {"png", "jpg"}) {
        const Answer still = curl(folder, daemon.url() + "/v1/frame." + kind + "?size=40x20");
        EXPECT_EQ(still.status, 200);
        const std::string name = folder.file(std::string("still.") + kind, still.body);
        ASSERT_TRUE(read_picture(name));
        EXPECT_EQ(read_picture(name)->width_px, 40);
    }
    const Answer wrong = curl(folder, daemon.url() + "/v1/frame.png?view=backwards");
    EXPECT_EQ(wrong.status, 400);
    EXPECT_NE(wrong.body.find("backwards"), std::string::npos) << wrong.body;
    EXPECT_EQ(curl(folder, daemon.url() + "/v1/frame.png?colour=red").status, 400);
}

TEST(Operations, AStillWhoseRevisionDoesNotComeIs504) {
    TemporaryFolder folder;
    DaemonProcess daemon({"--size", "64x64", "--still-timeout", "3"});  // the first still opens the picture library
    daemon.transport_ready();
    EXPECT_EQ(curl(folder, daemon.url() + "/v1/frame.png?after_rev=1000").status, 504);
    EXPECT_EQ(curl(folder, daemon.url() + "/v1/frame.png?size=16x16").status, 200);
}

TEST(Operations, HttpsWithACertificateThatIsReloaded) {
    TemporaryFolder folder;
    ASSERT_TRUE(make_certificate(folder.path(""), "one") && make_certificate(folder.path(""), "two"));
    const auto use = [&](const char* name) {
        for (const char* ending : {".crt", ".key"})
            std::filesystem::copy_file(folder.path(std::string(name) + ending),
                                       folder.path(std::string("used") + ending),
                                       std::filesystem::copy_options::overwrite_existing);
    };
    use("one");
    DaemonProcess daemon(
        {"--size", "64x64", "--tls-cert", folder.path("used.crt"), "--tls-key", folder.path("used.key")});
    ASSERT_EQ(daemon.url().rfind("https://", 0), 0u);
    EXPECT_EQ(curl(folder, "--cacert " + folder.path("one.crt") + " " + daemon.url() + "/readyz").status, 200);
    EXPECT_EQ(curl(folder, daemon.url() + "/readyz").status, 0) << "nobody trusts it unasked";
    const Finished trusting =
        run_program("gonio", {"--server", daemon.url(), "--ca", folder.path("one.crt"), "get", "scene"});
    EXPECT_EQ(trusting.exit_code, 0) << trusting.err;
    const Finished doubting = run_program("gonio", {"--server", daemon.url(), "get", "scene"});
    EXPECT_EQ(doubting.exit_code, 3);
    EXPECT_NE(doubting.err.find("certificate"), std::string::npos) << doubting.err;
    const Answer plain = curl(folder, "http" + daemon.url().substr(5) + "/readyz");
    EXPECT_EQ(plain.status, 400);
    EXPECT_NE(plain.body.find("HTTPS"), std::string::npos);
    std::ofstream(folder.path("used.crt")) << "broken";
    kill(daemon.pid(), SIGHUP);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    EXPECT_EQ(curl(folder, "--cacert " + folder.path("one.crt") + " " + daemon.url() + "/readyz").status, 200);
    use("two");
    kill(daemon.pid(), SIGHUP);
    int status = 0;
    for (int i = 0; i < 40 && status != 200; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        status = curl(folder, "--cacert " + folder.path("two.crt") + " " + daemon.url() + "/readyz").status;
    }
    EXPECT_EQ(status, 200);
    EXPECT_EQ(daemon.stop(), 0);
}

TEST(Operations, ATokenIsChangedWhileItRuns) {
    TemporaryFolder folder;
    const std::string token = folder.file("token", "the-first-token-of-two\n");
    DaemonProcess daemon({"--size", "64x64", "--token-file", token});
    const auto metrics = [&](const std::string& shown) {
        const std::string header = folder.file("auth", "Authorization: Bearer " + shown);
        return curl(folder, "-H @" + header + " " + daemon.url() + "/metrics");
    };
    EXPECT_EQ(curl(folder, daemon.url() + "/metrics").status, 401);
    const Answer told = metrics("the-first-token-of-two");
    EXPECT_EQ(told.status, 200);
    for (const char* name : {"gonio_frames_rendered_total ", "gonio_render_seconds_count ",
                             "gonio_readback_seconds_count ", "gonio_scene_revision ", "gonio_build_info{version=",
                             "gonio_frames_encoded_total{codec=\"h264\",lane=\"private\"} "})
        EXPECT_NE(told.body.find(std::string("\n") + name), std::string::npos) << name;
    folder.file("token", "the-second-token-of-two\n");
    kill(daemon.pid(), SIGHUP);
    int status = 0;
    for (int i = 0; i < 4 && status != 200; ++i) {  // fewer than the wrong tokens that are allowed
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        status = metrics("the-second-token-of-two").status;
    }
    EXPECT_EQ(status, 200);
    EXPECT_EQ(metrics("the-first-token-of-two").status, 401);
}

// A pipe stands where files were: it is refused at once, what stays is said, and the end is as prompt as ever.
TEST(Operations, AReloadSaysWhatStays) {
    TemporaryFolder folder;
    ASSERT_TRUE(make_certificate(folder.path(""), "used"));
    const std::string token = folder.file("token", "the-first-token-of-two\n"), certificate = folder.path("used.crt"),
                      whole = folder.path("whole.crt");
    DaemonProcess daemon(
        {"--size", "64x64", "--token-file", token, "--tls-cert", certificate, "--tls-key", folder.path("used.key")});
    const auto last_line = [&](const char* awaited) {
        std::string line;
        for (int i = 0; i < 100 && line.find(awaited) == std::string::npos; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            const std::string log = daemon.log();
            line = log.substr(0, log.find_last_not_of('\n') + 1);
            line = line.substr(line.rfind('\n') + 1);
        }
        return line;
    };
    kill(daemon.pid(), SIGHUP);
    EXPECT_NE(last_line("reloaded").find("reloaded"), std::string::npos);
    std::filesystem::rename(certificate, whole);
    ASSERT_EQ(mkfifo(certificate.c_str(), 0600), 0);
    kill(daemon.pid(), SIGHUP);
    EXPECT_NE(last_line("as before").find("as before: the log level, the certificate"), std::string::npos);
    EXPECT_NE(daemon.log().find("no regular file"), std::string::npos);
    std::filesystem::remove(token);
    std::filesystem::rename(whole, certificate);
    ASSERT_EQ(mkfifo(token.c_str(), 0600), 0);
    kill(daemon.pid(), SIGHUP);
    EXPECT_NE(last_line("the tokens").find("as before: the log level, the tokens"), std::string::npos);
    EXPECT_EQ(curl(folder, "--cacert " + certificate + " " + daemon.url() + "/readyz").status, 200);
    const auto began = std::chrono::steady_clock::now();
    EXPECT_EQ(daemon.stop(), 0);
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(), 2.5);
}

// SIGHUP comes when the tokens have been read and nobody listens yet: it is remembered.
TEST(Operations, ATokenIsChangedWhileItStarts) {
    TemporaryFolder folder;
    const std::string token = folder.file("token", "the-first-token-of-two\n");
    bool hung_up = false;
    DaemonProcess daemon({"--size", "64x64", "--token-file", token}, [&](pid_t pid) {
        // The libraries of the GL driver are loaded long after the tokens and before the first picture.
        std::ifstream maps("/proc/" + std::to_string(pid) + "/maps");
        const std::string text((std::istreambuf_iterator<char>(maps)), {});
        if (hung_up || text.find("libEGL_mesa") == std::string::npos) return;
        folder.file("token", "the-second-token-of-two\n");
        hung_up = kill(pid, SIGHUP) == 0;
    });
    if (!hung_up) GTEST_SKIP() << "another GL driver than Mesa's";
    const auto status = [&](const std::string& shown) {
        const std::string header = folder.file("auth", "Authorization: Bearer " + shown);
        return curl(folder, "-H @" + header + " " + daemon.url() + "/metrics").status;
    };
    EXPECT_EQ(status("the-second-token-of-two"), 200);
    EXPECT_EQ(status("the-first-token-of-two"), 401);
}

TEST(Operations, AViewersTokenLooksAndChangesNothing) {
    TemporaryFolder folder;
    const std::string token = folder.file("token", "the-token-of-all-rights\n"),
                      viewers = folder.file("viewers", "the-token-of-the-viewers\n"),
                      scene = folder.file("floor.gltf", floor_gltf(0.5));
    DaemonProcess daemon({"--size", "64x64", "--token-file", token, "--viewer-token-file", viewers});
    const auto gonio = [&](const std::string& shown, std::vector<std::string> words) {
        words.insert(words.begin(), {"--token-file", shown});
        return daemon.gonio(words);
    };
    EXPECT_EQ(gonio(viewers, {"get"}).exit_code, 0);
    EXPECT_EQ(gonio(viewers, {"capture", folder.path("look.png")}).exit_code, 0);
    for (const std::vector<std::string>& words : {std::vector<std::string>{"set", "exposure", "3"},
                                                  {"load", "scene", scene, "--upload"},
                                                  {"--role", "controller", "set", "exposure", "3"}}) {
        const Finished refused = gonio(viewers, words);
        EXPECT_EQ(refused.exit_code, 1) << words[0];
        EXPECT_NE(refused.err.find("permission"), std::string::npos) << refused.err;
    }
    EXPECT_EQ(gonio(token, {"load", "scene", scene, "--upload"}).exit_code, 0);
    const Finished own = gonio(token, {"--role", "viewer", "load", "scene", scene, "--upload"});
    EXPECT_EQ(own.exit_code, 1) << "whoever only wants to look uploads nothing either";
    EXPECT_NE(own.err.find("permission"), std::string::npos) << own.err;
}

TEST(Operations, ScenesAreUploadedAndTheRestOfTheDiskIsNotLoaded) {
    TemporaryFolder folder, root;
    const std::string inside = root.file("inside.gltf", floor_gltf(0.5)),
                      outside = folder.file("outside.gltf", floor_gltf(0.5));
    DaemonProcess daemon({"--size", "64x64", "--scene-root", root.path("")});
    daemon.rev({"load", "scene", inside});
    const Finished refused = daemon.gonio({"load", "scene", outside});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.err.find("permission"), std::string::npos) << refused.err;
    daemon.rev({"load", "scene", outside, "--upload"});
    EXPECT_EQ(daemon.json({"get", "scene"}), "upload:outside.gltf");
    EXPECT_EQ(daemon.json({"get", "lights[0].name"}), "lamp");
    const Finished named = daemon.gonio({"load", "scene", "upload:../outside.gltf"});
    EXPECT_EQ(named.exit_code, 1);
    EXPECT_EQ(curl(folder, "-T " + outside + " " + daemon.url() + "/v1/uploads/again.gltf").status, 201);
    // An uploaded file may refer to uploads only.
    Json thief = Json::parse(floor_gltf(0.5));
    thief["buffers"][0]["uri"] = "../../../../../../.." + outside;
    EXPECT_EQ(daemon.gonio({"load", "scene", folder.file("thief.gltf", thief.dump()), "--upload"}).exit_code, 1);
}

TEST(Operations, AConfigurationFileStartsTheServer) {
    TemporaryFolder folder;
    const std::string config = folder.file("goniod.toml", "size = \"96x64\"\nmax-clients = 1\nlog-level = \"warn\"\n");
    DaemonProcess daemon({"--config", config});
    EXPECT_EQ(daemon.json({"get", "size_px"}), Json({96, 64}));
    const Finished good = run_program("goniod", {"--config", config, "--check-config"});
    EXPECT_EQ(good.exit_code, 0) << good.err;
    const Finished bad = run_program("goniod", {"--config", folder.file("bad.toml", "\nsise = 3\n"), "--check-config"});
    EXPECT_EQ(bad.exit_code, 78);
    EXPECT_NE(bad.err.find("line 2"), std::string::npos) << bad.err;
    EXPECT_NE(bad.err.find("size"), std::string::npos) << bad.err;
}

TEST(Operations, TheManagerHearsOfReadinessAndTheEnd) {
    TemporaryFolder folder;
    const std::string socket = folder.path("notify");
    // A manager in a few lines of another language.
    const std::string manager = folder.file("manager.py",
                                            "import socket,sys\ns=socket.socket(socket.AF_UNIX,socket.SOCK_DGRAM)\n"
                                            "s.bind(sys.argv[1])\ns.settimeout(60)\n"
                                            "while True:\n  d=s.recv(999).decode()\n  print(d,flush=True)\n"
                                            "  if d=='STOPPING=1': break\n");
    std::thread listening([&] {
        [[maybe_unused]] const int ended =
            std::system(("python3 " + manager + " " + socket + " > " + folder.path("told")).c_str());
    });
    for (int i = 0; i < 200 && !std::filesystem::exists(socket); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    setenv("NOTIFY_SOCKET", socket.c_str(), 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    {
        DaemonProcess daemon({"--size", "64x64"});
        unsetenv("NOTIFY_SOCKET");
        unsetenv("WATCHDOG_USEC");
        std::this_thread::sleep_for(std::chrono::milliseconds(1200));
        EXPECT_EQ(daemon.stop(), 0);
    }
    listening.join();
    std::ifstream file(folder.path("told"));
    const std::string told((std::istreambuf_iterator<char>(file)), {});
    EXPECT_EQ(told.substr(0, 8), "READY=1\n");
    EXPECT_NE(told.find("WATCHDOG=1\n"), std::string::npos) << told;
    EXPECT_EQ(told.substr(told.size() - 11), "STOPPING=1\n") << told;
}

}  // namespace
}  // namespace gonio::test
