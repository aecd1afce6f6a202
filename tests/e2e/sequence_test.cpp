// Sequences of cornell, live and path-traced: two instruction sets on one machine, as docs/sequences.md promises of
// several machines; and layers against captures of one view.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "server/assets/assets.h"
#include "server/assets/exr.h"
#include "tests/e2e/daemon_process.h"

namespace gonio::test {
namespace {

struct Difference {
    std::size_t values = 0, differ = 0;
    double most = 0.0;  // of 8-bit values in 1/255; of floats relative to the larger of value and mean
};

void add(Difference& sum, const std::vector<float>& a, const std::vector<float>& b, bool bytes) {
    ASSERT_EQ(a.size(), b.size());
    double mean = 0.0;
    for (const float value : a) mean += std::abs(static_cast<double>(value)) / static_cast<double>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double difference = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
        ++sum.values;
        if (difference == 0.0) continue;
        ++sum.differ;
        const double unit = bytes ? 1.0 / 255.0 : std::max(mean, std::abs(static_cast<double>(a[i])));
        sum.most = std::max(sum.most, difference / unit);
    }
}

TEST(LongSequences, AreTheSameByTwoInstructionSetsWithinTheTolerance) {
    TemporaryFolder folder;
    const auto job = [&](const char* name, const char* out, const char* capture) {
        return folder.file(name, std::string(R"({"sequence":{"frames":2,"fps":1,"out":")") + out + R"(","capture":)" +
                                     capture +
                                     R"(,"tracks":[{"set":["light","luminaire","--level"],
                                     "keys":[{"t":0,"value":0.3},{"t":1,"value":1}]}]}})");
    };
    const std::string jobs[] = {
        job("png.json", "live.#.png", R"({"size":"160x120"})"),
        job("traced.json", "traced.#.png", R"({"size":"160x120","quality":"reference","noise":0.2})"),
        job("exr.json", "live.#.exr", R"({"size":"96x72","layers":["beauty","illuminance","depth"]})"),
        job("traced_exr.json", "traced.#.exr",
            R"({"size":"96x72","quality":"reference","noise":0.2,"layers":["beauty","illuminance","depth"]})")};
    for (const char* isa : {"avx2", "avx512"})
        for (const std::string& one : jobs) {
            const Finished done = run_program("goniod", {"--oneshot", one, "--out", folder.path(isa), "--isa", isa});
            if (done.exit_code == 2 && done.err.find("has not this instruction set") != std::string::npos)
                GTEST_SKIP() << done.err;
            ASSERT_EQ(done.exit_code, 0) << done.err;
            EXPECT_EQ(nlohmann::json::parse(done.out.substr(0, done.out.find('\n')))["isa"], isa);
        }
    Difference bytes, floats;
    for (const char* frame : {"0", "1"})
        for (const char* kind : {"live", "traced"}) {
            const std::string name = std::string("/") + kind + "." + frame;
            add(bytes, read_picture(folder.path("avx2") + name + ".png")->values,
                read_picture(folder.path("avx512") + name + ".png")->values, true);
            const auto a = read_exr(folder.path("avx2") + name + ".exr"),
                       b = read_exr(folder.path("avx512") + name + ".exr");
            ASSERT_TRUE(a && b);
            for (const auto& [channel, values] : a->channels) add(floats, values, b->channels.at(channel), false);
        }
    std::printf("8 bit: %zu of %zu values differ, by at most %.0f; EXR: %zu of %zu, by at most %.2g\n", bytes.differ,
                bytes.values, bytes.most, floats.differ, floats.values, floats.most);
    EXPECT_LE(bytes.differ, bytes.values / 1000);
    EXPECT_LE(bytes.most, 2.01);
    EXPECT_LE(floats.most, 1e-3);
}

TEST(LongSequences, LayersAreWhatCapturesOfOneViewShow) {
    TemporaryFolder folder;
    const auto run = [&](const std::string& name, const std::string& capture, const char* haze = "off") {
        const std::string job = folder.file(name + ".json", R"({"sequence":{"frames":1,"out":")" + name +
                                                                R"(.#.exr","capture":{"size":"96x72",)" + capture +
                                                                R"(},"set":[["haze",")" + haze + R"("]]}})");
        const Finished done = run_program("goniod", {"--oneshot", job, "--out", folder.path("out")});
        EXPECT_EQ(done.exit_code, 0) << done.err;
        auto file = read_exr(folder.path("out/" + name + ".0.exr"));
        EXPECT_TRUE(file);
        return *file;
    };
    EXPECT_EQ(run("haze", R"("layers":["beauty"])", "show").channels.size(), 6u) << "rgb, and rgb of haze";
    const ExrFile all = run("all", R"("layers":"all")");
    EXPECT_EQ(all.channels.size(), 3u + 3 + 3 + 1 + 1 + 1 + 3 + 1);
    EXPECT_NE(all.texts.at("gonio:error").find(" lx in the middle of the picture"), std::string::npos)
        << all.texts.at("gonio:error");
    EXPECT_EQ(all.texts.at("gonio:quality"), "interactive");
    for (const char* view : {"luminance", "illuminance"}) {
        const ExrFile one = run(view, std::string(R"("view":")") + view + "\"");
        Difference sum;
        add(sum, one.channels.at("Y"), all.channels.at(std::string(view) + ".Y"), false);
        EXPECT_LE(sum.most, 1e-5) << view;
        EXPECT_EQ(one.texts.at("gonio:unit"), std::string_view(view) == "luminance" ? "cd/m2" : "lx");
    }
    double beauty = 0, parts = 0;  // of what shows no luminous opening
    for (std::size_t i = 0; i < all.channels.at("G").size(); ++i) {
        const double sum = static_cast<double>(all.channels.at("direct.G")[i] + all.channels.at("indirect.G")[i]),
                     shown = static_cast<double>(all.channels.at("G")[i]);
        if (shown > 2.0 * sum) continue;
        beauty += shown;
        parts += sum;
    }
    EXPECT_GT(parts, 0.0);
    EXPECT_NEAR(beauty, parts, 1e-3 * parts);
}

}  // namespace
}  // namespace gonio::test
