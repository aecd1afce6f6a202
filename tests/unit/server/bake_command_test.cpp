// `gonio bake`, `gonio doctor`, and the options of goniod that their words become.
#include <gtest/gtest.h>

#include <algorithm>

#include "client/cli/bake.h"
#include "client/cli/beside.h"
#include "server/app/options.h"
#include "server/assets/assets.h"

namespace gonio {
namespace {

std::vector<std::string> arguments_of(const std::vector<std::string>& words) {
    const ReadWords read = read_command_line(words);
    if (!read.fault) return bake_arguments(read);
    ADD_FAILURE() << read.fault->text();
    return {};
}

TEST(BakeCommand, WordsBecomeOptionsOfGoniod) {
    EXPECT_EQ(
        arguments_of({"bake", "cornell", "maps", "haze show", "--size", "512", "--scale=0.01", "--memory", "100"}),
        (std::vector<std::string>{"--bake=cornell", "--out=maps", "--bake-set=haze show", "--bake-size=512",
                                  "--bake-memory=100", "--scale=0.01"}));
    EXPECT_TRUE(read_command_line(std::vector<std::string>{"bake", "cornell"}).fault);
    EXPECT_TRUE(read_command_line(std::vector<std::string>{"bake", "cornell", "maps", "--size", "x"}).fault);
}

TEST(DoctorCommand, WordsBehindTheDashesAreOptionsOfGoniod) {
    const ReadWords read = read_command_line(
        std::vector<std::string>{"doctor", "--json", "--", "--listen", "127.0.0.1:0", "--sacn=0.0.0.0"});
    ASSERT_FALSE(read.fault) << read.fault->text();
    const auto arguments = doctor_arguments(read, read.has("--json"));
    EXPECT_EQ(arguments,
              (std::vector<std::string>{"--doctor", "--log=json", "--listen", "127.0.0.1:0", "--sacn=0.0.0.0"}));
    int exit_code = -1;
    const auto options = parse_options(arguments, exit_code);
    ASSERT_TRUE(options) << exit_code;
    EXPECT_TRUE(options->doctor);
    EXPECT_FALSE(options->serves());
    EXPECT_TRUE(options->inputs.sacn);
}

// Every option of the one is an option of the other, and none is lost on the way.
TEST(BakeCommand, GoniodTakesEachOfThem) {
    const std::pair<const char*, const char*> kValues[] = {
        {"--size", "64"},         {"--texel", "0.5"},      {"--uv", "second"},    {"--directions", "64"},
        {"--bounces", "3"},       {"--tolerance", "0.01"}, {"--openings", "off"}, {"--steps", "7"},
        {"--steps-form", "even"}, {"--air", "rays"},       {"--format", "half"},  {"--memory", "99"},
        {"--threads", "2"},       {"--seed", "5"},         {"--scale", "2"}};
    const ReadWords bake = read_command_line(std::vector<std::string>{"bake", "cylinder", "maps"});
    ASSERT_TRUE(bake.command);
    EXPECT_EQ(bake.command->options.size(), std::size(kValues));
    std::vector<std::string> words{"bake", "cylinder", "maps", "haze fog", "light key --level 1"};
    for (const auto& [name, value] : kValues) words.insert(words.end(), {name, value});
    int exit_code = -1;
    const auto options = parse_options(arguments_of(words), exit_code);
    ASSERT_TRUE(options) << exit_code;
    EXPECT_FALSE(options->serves());
    EXPECT_EQ(options->scene, "cylinder");
    EXPECT_EQ(options->out, "maps");
    const BakeOptions& of = options->bake;
    EXPECT_EQ(of.set, (std::vector<std::string>{"haze fog", "light key --level 1"}));
    EXPECT_EQ(of.size, 64);
    EXPECT_EQ(of.texel_m, 0.5);
    EXPECT_EQ(of.uv, "second");
    EXPECT_EQ(of.directions, 64);
    EXPECT_EQ(of.bounces, 3);
    EXPECT_EQ(of.tolerance, 0.01);
    EXPECT_EQ(of.openings, "off");
    EXPECT_EQ(of.steps, 7);
    EXPECT_EQ(of.steps_form, "even");
    EXPECT_EQ(of.air, "rays");
    EXPECT_EQ(of.format, "half");
    EXPECT_EQ(of.memory_mib, 99u);
    EXPECT_EQ(of.seed, 5u);
    EXPECT_EQ(options->load.scale, 2.0);
    EXPECT_EQ(options->threads, 2);
}

TEST(BakeCommand, WrongValuesAreUsage) {
    for (const char* wrong : {"--bake-size=8", "--bake-size=9000", "--bake-directions=0", "--bake-uv=third",
                              "--bake-tolerance=nan", "--bake-steps=0", "--bake-memory=1", "--bake=/nowhere.glb"}) {
        int exit_code = -1;
        EXPECT_FALSE(parse_options({"--bake=cornell", wrong}, exit_code)) << wrong;
        EXPECT_EQ(exit_code, 2) << wrong;
    }
}

// The scene is found by name, as the others are; its lights are six strips that look inwards.
TEST(BakeCommand, TheCylinderIsABuiltInScene) {
    const auto scene = load_scene("cylinder");
    ASSERT_TRUE(scene);
    EXPECT_TRUE(is_built_in("cylinder"));
    ASSERT_EQ((*scene)->lights.size(), 6u);
    for (const LightSeed& light : (*scene)->lights) {
        const glm::dvec3 aim = light.world_from_light * glm::dvec3(0, 0, -1),
                         c0 = light.world_from_light * glm::dvec3(1, 0, 0);
        const glm::dvec3 inwards = -glm::normalize(glm::dvec3(light.position.x, light.position.y, 0.0));
        EXPECT_NEAR(glm::dot(aim, inwards), 1.0, 1e-9);
        EXPECT_NEAR(c0.z, 1.0, 1e-9) << "the length runs along the axis";
    }
}

}  // namespace
}  // namespace gonio
