// Options from a file and the environment.
#include "server/app/config.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "server/app/http_options.h"
#include "server/app/options.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

struct ConfigTest : testing::Test {
    fs::path folder;
    std::vector<std::string> names;  // of variables that were set
    ConfigTest() {
        std::string pattern = (fs::temp_directory_path() / "gonio-config-XXXXXX").string();
        folder = mkdtemp(pattern.data());
    }
    ~ConfigTest() override {
        fs::remove_all(folder);
        for (const std::string& name : names) unsetenv(name.c_str());
    }
    std::string file(const std::string& text, const std::string& name = "goniod.toml") const {
        std::ofstream(folder / name) << text;
        return (folder / name).string();
    }
    void set(const std::string& name, const std::string& value) {
        setenv(name.c_str(), value.c_str(), 1);
        names.push_back(name);
    }
    // What is printed, and the exit code where no options come.
    std::optional<Options> parse(std::vector<std::string> arguments) {
        testing::internal::CaptureStdout();
        testing::internal::CaptureStderr();
        exit_code = -1;
        auto options = parse_options(arguments, exit_code);
        out = testing::internal::GetCapturedStdout();
        err = testing::internal::GetCapturedStderr();
        return options;
    }
    int exit_code = -1;
    std::string out, err;
};

TEST_F(ConfigTest, OldSpellingsAreRead) {
    auto options = parse({"--gather", "simd"});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->direct_light, "rays");
    options = parse({"--config", file("gather = \"gl\"\n")});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->direct_light, "gl");
    set("GONIOD_GATHER", "gl");
    options = parse({});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->direct_light, "gl");
}

TEST_F(ConfigTest, FlagBeatsVariableBeatsFileBeatsDefault) {
    const std::string config = file(
        "# a show\nsize = \"320x200\"\nmax-clients = 7\ntarget-fps = 25\nheader-timeout = 2.5\n"
        "ignore-preview = true\nhost-name = [\"a.example\", \"b.example\"]\n");
    set("GONIOD_MAX_CLIENTS", "8");
    set("GONIOD_TARGET_FPS", "30");
    const auto options = parse({"--config", config, "--target-fps", "50"});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->width_px, 320);
    EXPECT_EQ(options->limits.clients, 8u);
    EXPECT_EQ(options->target_fps, 50);
    EXPECT_TRUE(options->keep_up);
    EXPECT_EQ(options->limits.header, std::chrono::milliseconds(2500));
    EXPECT_FALSE(options->inputs.accept_preview);
    EXPECT_EQ(options->host_names, (std::vector<std::string>{"a.example", "b.example"}));
    EXPECT_EQ(options->limits.connections, 256u);
    set("GONIOD_CONFIG", config);
    EXPECT_EQ(parse({})->width_px, 320) << "the file may be named by a variable too";
}

TEST_F(ConfigTest, EveryErrorNamesItsLine) {
    const std::string config = file(
        "size = \"320x200\"\nmax-client = 3\n\nmax-clients = \"many\"\nmax-side = 5000\n"
        "listen = 8080\nignore-preview = 1\n[net]\nport = 1\n");
    EXPECT_FALSE(parse({"--config", config, "--check-config"}));
    EXPECT_EQ(exit_code, 78);
    const struct {
        const char *line, *what;
    } rows[] = {
        {"line 2", "did you mean max-clients"}, {"line 4", "must be a number, not"}, {"line 5", "5000"},
        {"line 6", "must be a string"},         {"line 7", "true or false"},         {"line 8", "net is no option"}};
    for (const auto& row : rows) {
        const std::size_t at = err.find(row.line);
        ASSERT_NE(at, std::string::npos) << row.line << "\n" << err;
        EXPECT_NE(err.substr(at, err.find('\n', at) - at).find(row.what), std::string::npos) << err;
    }
    EXPECT_FALSE(parse({"--config", config}));
    EXPECT_EQ(exit_code, 78) << "nor does it start";
    EXPECT_FALSE(parse({"--config", file("a = \n", "broken.toml")}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("line 1"), std::string::npos) << err;
    EXPECT_FALSE(parse({"--config", (folder / "none.toml").string()}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_FALSE(parse({"--config", file("size = \"12\"\n", "size.toml")}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("size.toml line 1"), std::string::npos) << err;
}

TEST_F(ConfigTest, VariablesAreChecked) {
    set("GONIOD_MAX_SIDE", "huge");
    EXPECT_FALSE(parse({}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("GONIOD_MAX_SIDE"), std::string::npos) << err;
    unsetenv("GONIOD_MAX_SIDE");
    set("GONIOD_TOKEN", "not a place for a secret");
    EXPECT_TRUE(parse({}));
    EXPECT_NE(err.find("GONIOD_TOKEN"), std::string::npos) << err;
    EXPECT_EQ(err.find("secret"), std::string::npos) << "values are not printed";
    set("GONIOD_HOST_NAME", "a.example,b.example");
    EXPECT_EQ(parse({})->host_names.size(), 2u);
}

TEST_F(ConfigTest, TheCommandLineKeepsItsExitCode) {
    EXPECT_FALSE(parse({"--max-clients", "many"}));
    EXPECT_EQ(exit_code, 2);
    EXPECT_FALSE(parse({"--size", "banana"}));
    EXPECT_EQ(exit_code, 2);
    EXPECT_FALSE(parse({"--help"}));
    EXPECT_EQ(exit_code, 0);
}

TEST_F(ConfigTest, WhatIsPrintedGivesTheSameOptions) {
    const std::string config = file("size = \"320x200\"\nstate = \"a\\\"b\"\n");
    set("GONIOD_DEAD_TIMEOUT", "45");
    EXPECT_FALSE(parse({"--config", config, "--max-clients", "9", "--print-config"}));
    EXPECT_EQ(exit_code, 0);
    const std::string printed = out;
    EXPECT_NE(printed.find("size = \"320x200\"  # " + config + " line 1\n"), std::string::npos) << printed;
    EXPECT_NE(printed.find("\ndead-timeout = 45  # GONIOD_DEAD_TIMEOUT\n"), std::string::npos) << printed;
    EXPECT_NE(printed.find("\nmax-clients = 9  # command line\n"), std::string::npos) << printed;
    EXPECT_NE(printed.find("\n# ping-interval = 10  # default\n"), std::string::npos) << printed;
    EXPECT_NE(printed.find("\n# listen = \"127.0.0.1:8080\"  # default\n"), std::string::npos) << printed;
    unsetenv("GONIOD_DEAD_TIMEOUT");
    const auto again = parse({"--config", file(printed, "again.toml")});
    ASSERT_TRUE(again) << err;
    EXPECT_EQ(again->limits.clients, 9u);
    EXPECT_EQ(again->limits.dead, std::chrono::seconds(45));
    EXPECT_EQ(again->state_file, "a\"b");
    EXPECT_FALSE(again->keep_up) << "a default that is printed is not given";
}

TEST_F(ConfigTest, ValuesThatStopTheStartAreErrorsWithTheirLines) {
    const std::string config = file(
        "listen = \"abc\"\nsacn = \"bad\"\nartnet = \"bad\"\nosc = \"1.2.3.4:99999\"\nsize = \"foo\"\nbox = [\"q\"]\n"
        "technique = \"bogus\"\nsamples = 5000\nscene = \"no.gltf\"\npatch = \"no.toml\"\nsurface-map = \"/\"\n"
        "host-name = [\"a\", \"*\"]\nupload-dir = \"/dev/null/up\"\nsurface-replay = \"none\"\n");
    EXPECT_FALSE(parse({"--config", config, "--check-config"}));
    EXPECT_EQ(exit_code, 78);
    for (int line = 1; line <= 14; ++line)
        EXPECT_NE(err.find("line " + std::to_string(line) + ":"), std::string::npos) << line << "\n" << err;
    EXPECT_EQ(out, "");
    for (const char* size : {"17x17", "18x19", "8x16", "16x4098", "16x", "16x16x16", "+16x16", "016", "0x10"}) {
        EXPECT_FALSE(parse({"--size", size})) << size;
        EXPECT_EQ(exit_code, 2) << size;
    }
    for (const char* listen : {"8080", ":80", "a b:80", "gonio.example:80", "127.0.0.1:", "127.0.0.1:65536", "[]:80"})
        EXPECT_FALSE(parse({"--listen", listen})) << listen;
    EXPECT_EQ(parse({"--listen", "[::1]:80"})->host, "::1");
    EXPECT_EQ(parse({"--box", "12aB:00Ff=x.toml"})->boxes, std::vector<std::string>{"12ab:00ff=x.toml"});
    EXPECT_EQ(parse({"--size", "16x4096"})->height_px, 4096);
    EXPECT_TRUE(parse({"--scene", "atrium", "--patch", file("", "patch.toml")})) << err;
}

// What is wrong only beside other options, or with a file that an option names.
TEST_F(ConfigTest, FaultsOfMoreThanOneOptionNameTheirLinesToo) {
    const struct {
        const char *text, *begins, *holds;
    } rows[] = {
        {"\nsamples = 3\n", " line 2: --samples", "not 3"},
        {"samples = 3\n\ntechnique = \"default\"\n", " line 3: --samples", "goniod.toml line 1, "},
        {"dead-timeout = 5\n", " line 1: --dead-timeout", "5 s is not longer than 10 s"},
        {"\nping-interval = 40\n", " line 2: --dead-timeout", "30 s is not longer than 40 s"},
        {"\n\ntoken-file = \"/nope\"\n", " line 3: cannot be read", "--token-file: /nope"},
        {"\nscene-root = [\"/nope\"]\n", " line 2: --scene-root", "/nope"},
        {"\ntls-cert = \"x\"\n", " line 2: --tls-cert", "--tls-key is missing"},
        {"tls-cert = \"/nope\"\ntls-key = \"/nope/either\"\n", " line 1: ", "/nope"},
        {"\nlisten = \"0.0.0.0:80\"\n", " line 2: listening", "0.0.0.0"},
    };
    for (const auto& row : rows) {
        EXPECT_FALSE(parse({"--config", file(row.text), "--check-config"})) << row.text;
        EXPECT_EQ(exit_code, 78);
        EXPECT_NE(err.find(row.begins), std::string::npos) << row.text << err;
        EXPECT_NE(err.find(row.holds), std::string::npos) << row.text << err;
    }
    set("GONIOD_DEAD_TIMEOUT", "7");
    EXPECT_FALSE(parse({}));
    EXPECT_NE(err.find("goniod: GONIOD_DEAD_TIMEOUT: --dead-timeout"), std::string::npos) << err;
    EXPECT_FALSE(parse({"--dead-timeout", "5"}));
    EXPECT_NE(err.find("goniod: --dead-timeout"), std::string::npos) << "the command line needs no place: " << err;
}

// The doctor says what is wrong with them, and examines the machine with the others.
TEST_F(ConfigTest, TheDoctorGoesOnWithoutWhatIsWrong) {
    const std::string config =
        file("listen = \"0.0.0.0:81\"\nupload-dir = \"/dev/null/up\"\nencoder = \"mjpeg\"\nno-option = 1\n");
    const auto options = parse({"--doctor", "--config", config});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->port, 81);
    EXPECT_EQ(options->encoder, "mjpeg");
    ASSERT_EQ(options->faults.size(), 3u) << err;
    EXPECT_NE(options->faults[2].find("needs --token-file"), std::string::npos);
    EXPECT_EQ(err, "");
    EXPECT_FALSE(parse({"--doctor", "--listen", "x"}));
    EXPECT_EQ(exit_code, 2) << "an argument ends it as ever";
}

// Whoever opens or reads a pipe or a device may wait for ever.
TEST_F(ConfigTest, OnlyRegularFilesAreRead) {
    EXPECT_FALSE(parse({"--config", "/dev/null"}));
    ASSERT_EQ(exit_code, 78) << "also without a pipe, which would hold up this test";
    EXPECT_NE(err.find("/dev/null: the file is no regular file"), std::string::npos) << err;
    const std::string pipe = (folder / "pipe").string();
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--config", pipe},
                                                      {"--token-file", pipe},
                                                      {"--tls-cert", pipe, "--tls-key", pipe},
                                                      {"--patch", pipe},
                                                      {"--surface-map", folder.string()}}) {
        EXPECT_FALSE(parse(arguments)) << arguments[0];
        EXPECT_TRUE(err.find("no regular file") != std::string::npos || err.find("a folder") != std::string::npos)
            << arguments[0] << ": " << err;
    }
}

TEST_F(ConfigTest, SamplesFitTheTechnique) {
    EXPECT_FALSE(parse({"--config", file("samples = 5\n"), "--check-config"}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("--samples"), std::string::npos) << err;
    EXPECT_EQ(parse({"--samples", "5", "--technique", "seed"})->samples, 5u);
    const std::string show = (folder / "show").string();
    EXPECT_TRUE(parse({"--samples", "5", "--state", show})) << "the saved show may use seed";
    EXPECT_FALSE(parse({"--samples", "5", "--state", show, "--technique", "default"}));
}

TEST_F(ConfigTest, UploadsNeedAFolderThatCanBe) {
    EXPECT_TRUE(parse({"--upload-dir", (folder / "to" / "be" / "made").string()})) << err;
    EXPECT_FALSE(fs::exists(folder / "to")) << "checking makes nothing";
    EXPECT_TRUE(parse({"--upload-dir", folder.string() + "/"})) << err;
    for (const std::string& bad : {file("", "plain"), file("", "plain") + "/below", std::string(300, 'x')}) {
        EXPECT_FALSE(parse({"--upload-dir", bad})) << bad;
        EXPECT_EQ(exit_code, 2);
        EXPECT_NE(err.find("--upload-dir"), std::string::npos) << err;
    }
}

TEST_F(ConfigTest, NoNumberIsNotANumber) {
    for (const char* option :
         {"--target-fps", "--header-timeout", "--ping-interval", "--dead-timeout", "--write-timeout",
          "--identify-timeout", "--key-interval", "--still-timeout", "--max-updates", "--max-update-burst"})
        for (const char* value : {"nan", "-nan", "inf", "-inf", "1e400", "0", "1x", ""}) {
            EXPECT_FALSE(parse({std::string(option) + "=" + value})) << option << " " << value;
            EXPECT_EQ(exit_code, 2) << option << " " << value;
        }
    for (const char* option : {"--scale", "--target-fps", "--samples", "--max-clients", "--max-side", "--device"})
        for (const char* value : {"0x10", "0X1p4"}) {
            EXPECT_FALSE(parse({std::string(option) + "=" + value})) << option << " " << value;
            EXPECT_EQ(exit_code, 2) << option << " " << value;
            EXPECT_NE(err.find(std::string(option) + ": "), std::string::npos) << err;
        }
    EXPECT_FALSE(parse({"--config", file("max-updates = nan\n")}));
    EXPECT_NE(err.find("line 1"), std::string::npos) << err;
}

TEST_F(ConfigTest, NumbersArePrintedAsTheyAreRead) {
    EXPECT_FALSE(parse({"--print-config", "--header-timeout", ".5", "--target-fps", "60.", "--max-clients", "010",
                        "--max-local-clients", "00", "--device", "-01", "--max-header-kib", "+7"}));
    EXPECT_EQ(exit_code, 0);
    for (const char* line : {"header-timeout = 0.5 ", "target-fps = 60 ", "max-clients = 8 ", "max-local-clients = 0 ",
                             "device = -1 ", "max-header-kib = 7 "})
        EXPECT_NE(out.find("\n" + std::string(line)), std::string::npos) << line << "\n" << out;
    const auto again = parse({"--config", file(out)});
    ASSERT_TRUE(again) << err;
    EXPECT_EQ(again->limits.clients, 8u);
    EXPECT_EQ(again->limits.header, std::chrono::milliseconds(500));
    EXPECT_EQ(again->device, -1);
}

TEST_F(ConfigTest, AVariableCannotEmptyAList) {
    set("GONIOD_SCENE_ROOT", ",");
    EXPECT_FALSE(parse({"--config", file("scene-root = [\"/\"]\n")}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("GONIOD_SCENE_ROOT"), std::string::npos) << err;
}

TEST_F(ConfigTest, AnEmptyTextIsAValue) {
    const auto options = parse({"--config", file("patch = \"\"\nsacn = \"off\"\ntoken-file = \"\"\n")});
    ASSERT_TRUE(options) << err;
    EXPECT_EQ(options->token_file, "");
}

TEST_F(ConfigTest, HostNamesAreNamesOrAddresses) {
    for (const char* good : {"gonio", "a.example", "A-1.example.", "my_host", "10.0.0.1", "::1", "2001:db8::7"})
        EXPECT_TRUE(parse({"--host-name=" + std::string(good)})) << good << err;
    for (const std::string& bad :
         {std::string("*"), std::string("a b"), std::string("http://x:1"), std::string("x:1"), std::string("a..b"),
          std::string("."), std::string("-a"), std::string("a/"), std::string("*.example"), std::string(64, 'a'),
          std::string("b\xC3\xBCro.example")}) {
        EXPECT_FALSE(parse({"--host-name=" + bad})) << bad;
        EXPECT_EQ(exit_code, 2);
    }
    for (const char* text : {"host-name = [\"[::1]\"]\n", "host-name = \"[a,b]\"\n"}) {
        EXPECT_FALSE(parse({"--config", file(text)})) << text;
        EXPECT_NE(err.find("line 1"), std::string::npos) << err;
        EXPECT_NE(err.find("brackets"), std::string::npos) << err;
    }
    EXPECT_FALSE(parse({"--host-name=[::1]"})) << "no list of CLI11 either";
    EXPECT_EQ(parse({"--host-name", "a", "--host-name", "b"})->host_names, (std::vector<std::string>{"a", "b"}));
    EXPECT_FALSE(parse({"--config", file("host-name = [\"\"]\n")}));
    EXPECT_NE(err.find("line 1"), std::string::npos) << err;
}

TEST_F(ConfigTest, OriginsAreSchemeHostAndPort) {
    for (const char* good :
         {"https://x", "http://a.example:8080", "HTTPS://x", "http://[::1]:80", "https://[2001:db8::7]"})
        EXPECT_TRUE(parse({"--allow-origin", good})) << good << err;
    for (const char* bad : {"*", "foo", "null", "https://", "https://x/a", "https://x//", "https://*",
                            "https://x:", "ws://x", "https://x:0", "https://x:65536", "https://x:1:2", "https://u@x",
                            "http://::1", "http://[::1", "http://[::1]x", "https://x?y"}) {
        EXPECT_FALSE(parse({"--allow-origin", bad})) << bad;
        EXPECT_EQ(exit_code, 2) << bad;
    }
    EXPECT_FALSE(parse({"--config", file("allow-origin = [\"\"]\n")}));
    EXPECT_FALSE(parse({"--allow-origin", "https://x:1/"}));
    EXPECT_NE(err.find("'https://x:1' without the slash"), std::string::npos) << err;
}

TEST_F(ConfigTest, OptionsThatDoNotGoTogetherAreErrors) {
    EXPECT_FALSE(parse({"--listen", "0.0.0.0:0"}));
    EXPECT_EQ(exit_code, 78);
    EXPECT_NE(err.find("--token-file"), std::string::npos);
    EXPECT_TRUE(parse({"--listen", "0.0.0.0:0", "--token-file", file("0123456789abcdef\n", "token")}));
    EXPECT_FALSE(parse({"--token-file", file("short\n", "short")}));
    const std::string token = file("0123456789abcdef\n", "token");
    EXPECT_TRUE(parse({"--token-file", token, "--viewer-token-file", file("fedcba9876543210\n", "viewers")}));
    EXPECT_FALSE(parse({"--viewer-token-file", token}));
    EXPECT_NE(err.find("--viewer-token-file"), std::string::npos) << err;
    EXPECT_NE(err.find("--token-file too"), std::string::npos) << err;
    EXPECT_FALSE(parse({"--token-file", token, "--viewer-token-file", file(" 0123456789abcdef", "same")}));
    EXPECT_NE(err.find("another token"), std::string::npos) << err;
    EXPECT_FALSE(parse({"--token-file", token, "--viewer-token-file", file("short", "short")}));
    EXPECT_FALSE(parse({"--tls-cert", file("", "c")}));
    EXPECT_NE(err.find("belong together"), std::string::npos);
    EXPECT_FALSE(parse({"--tls-cert", file("x", "c"), "--tls-key", file("x", "k")}));
    EXPECT_FALSE(parse({"--scene-root", (folder / "none").string()}));
    EXPECT_FALSE(parse({"--ping-interval", "30", "--dead-timeout", "20"}));
    EXPECT_FALSE(parse({"--check-config"}));
    EXPECT_EQ(exit_code, 0);
    EXPECT_EQ(out, "ok\n");
}

TEST_F(ConfigTest, ATokenThatOthersCanReadIsWarnedOf) {
    const std::string path = file("0123456789abcdef\n", "token");
    std::string warning;
    fs::permissions(path, fs::perms::owner_read | fs::perms::others_read);
    EXPECT_EQ(*token_of_file(path, &warning), "0123456789abcdef");
    EXPECT_NE(warning.find(path), std::string::npos);
    warning.clear();
    fs::permissions(path, fs::perms::owner_read);
    EXPECT_TRUE(token_of_file(path, &warning));
    EXPECT_EQ(warning, "");
}

TEST_F(ConfigTest, ATokenIsWhatHttpCanCarry) {
    const std::string token = "0123456789abcdef";
    for (const std::string& text : {token, token + "\r\n", " \t" + token + "\t \r\nmore", token + "\n\xFF\n"}) {
        const auto read = token_of_file(file(text, "token"));
        ASSERT_TRUE(read) << text;
        EXPECT_EQ(*read, token);
    }
    const struct {
        std::string text, what;
    } rows[] = {{"secret89 abcdefgh\n", "byte 9 "},
                {" secret89abc\tdefgh\n", "byte 13 "},
                {"secret89abcdefg\xC3\xA4\n", "byte 16 "},
                {"\xEF\xBB\xBFsecret89abcdefgh\n", "byte 1 "},
                {std::string("secret89\0abcdefgh", 17), "byte 9 "},
                {"secret89abcdefg\x7F\n", "byte 16 "},
                {"secret89abcdefg    \n", "at least 16 bytes"},
                {"", "at least 16 bytes"},
                {" \t\r\nsecret89abcdefgh", "at least 16 bytes"},
                {std::string(5000, 's'), "no longer than 4096"}};
    for (const auto& row : rows) {
        const auto read = token_of_file(file(row.text, "token"));
        ASSERT_FALSE(read) << row.text;
        EXPECT_NE(read.error().message.find(row.what), std::string::npos) << read.error().text();
        EXPECT_EQ(read.error().text().find("secret"), std::string::npos) << read.error().text();
    }
    EXPECT_NE(token_of_file((folder / "none").string()).error().text().find("cannot be read"), std::string::npos);
    EXPECT_FALSE(token_of_file(folder.string()));
}

TEST_F(ConfigTest, AFollowerTakesNothingThatItsLeaderSays) {
    const std::string leader = "http://127.0.0.1:1";
    auto options = parse({"--follow", leader});
    ASSERT_TRUE(options) << err;
    EXPECT_FALSE(options->surfaces) << "fader boxes are the leader's";
    for (const std::vector<std::string>& of_leader : std::vector<std::vector<std::string>>{{"--scene", "cornell"},
                                                                                           {"--size", "64x64"},
                                                                                           {"--scale", "2"},
                                                                                           {"--technique", "seed"},
                                                                                           {"--samples", "100"},
                                                                                           {"--state", "x.json"},
                                                                                           {"--shows", folder},
                                                                                           {"--gels", ""},
                                                                                           {"--patch", ""},
                                                                                           {"--sacn", "127.0.0.1"},
                                                                                           {"--artnet", "127.0.0.1"},
                                                                                           {"--osc", "127.0.0.1"}}) {
        EXPECT_FALSE(parse({"--follow", leader, of_leader[0], of_leader[1]}));
        EXPECT_EQ(exit_code, 78);
        EXPECT_NE(err.find(of_leader[0] + " does not go with --follow"), std::string::npos) << err;
    }
    EXPECT_FALSE(parse({"--config", file("follow = \"" + leader + "\"\nscene = \"atrium\"\n")}));
    EXPECT_NE(err.find("line 2: --scene does not go"), std::string::npos) << err;
    for (const char* none : {"ftp://x", "http://", "http://x:port"}) {
        EXPECT_FALSE(parse({"--follow", none}));
        EXPECT_NE(err.find("--follow"), std::string::npos) << err;
    }
    EXPECT_FALSE(parse({"--follow", ""})) << "as of a variable that nobody has set";
    EXPECT_FALSE(parse({"--follow", leader, "--max-upload-mib", "0"}));
    EXPECT_FALSE(parse({"--follow-token-file", file("0123456789abcdef", "token")})) << "without --follow";
    EXPECT_TRUE(parse({"--follow", leader, "--follow-token-file", file("0123456789abcdef", "token")})) << err;
}

}  // namespace
}  // namespace gonio
