// A job's list of captures: the same bytes at any time, and from any share of them.
#include "server/app/oneshot.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>

#include "server/assets/exr.h"
#include "server/scene/scene.h"
#include "tests/scenes/scenes.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;  // bytes by name

class OneshotFrames : public testing::Test {
protected:
    OneshotFrames() {
        char name[] = "/tmp/gonio_oneshot_XXXXXX";
        folder_ = ::mkdtemp(name);
    }
    ~OneshotFrames() override { fs::remove_all(folder_); }

    // Result: what the job writes into a folder of this name.
    Files run(const std::string& name, sequence::Shard shard = {}, const std::string& head = "") {
        std::string frames;
        for (const char* out : {"a.exr", "b.exr", "c.png"})
            frames += std::string(frames.empty() ? "" : ",") + R"({"set":[["light","lamp","--level",")" +
                      (frames.empty() ? "0.5" : "0.25") + R"("]],"capture":{"out":")" + out +
                      R"(","quality":"reference","noise":0.3,"size":"16x9"}})";
        const std::string job = (folder_ / (name + ".json")).string();
        std::ofstream(job) << "{" << head << "\"frames\":[" << frames << "]}";
        sequence::RunOptions options;
        options.out = (folder_ / name).string();
        options.shard = shard;
        options.renderer = []() -> Renderer& { throw std::logic_error("the reference needs no GL"); };
        Scene scene = test::floor_scene(8.0, 0.5f, test::isotropic(1000.0), {0.0, 2.0, 0.0});
        scene.lights.front().name = "lamp";
        scene.camera = {{0.5, 5.0, 4.0}, {0.0, 0.0, 0.0}, 1.2};
        EXPECT_EQ(run_oneshot(std::move(scene), job, {}, options), 0);
        Files files;
        for (const auto& entry : fs::directory_iterator(folder_ / name)) {
            std::ifstream stream(entry.path(), std::ios::binary);
            files[entry.path().filename().string()] = {std::istreambuf_iterator<char>(stream), {}};
        }
        return files;
    }
    std::string date_of(const std::string& file) const {
        const auto read = read_exr((folder_ / file).string());
        EXPECT_TRUE(read);
        return read && read->texts.contains("DateTime") ? read->texts.at("DateTime") : "";
    }

    fs::path folder_;
};

TEST_F(OneshotFrames, HaveNoClockInThem) {
    const Files first = run("first");
    ASSERT_EQ(first.size(), 3u);
    EXPECT_EQ(date_of("first/a.exr"), "1970:01:01 00:00:00");
    EXPECT_EQ(run("again"), first);
    EXPECT_NE(run("dated", {}, R"("date":"2026-02-28T12:00:00Z",)").at("a.exr"), first.at("a.exr"));
    EXPECT_EQ(date_of("dated/a.exr"), "2026:02:28 12:00:00");
}

TEST_F(OneshotFrames, AreTheSameInShares) {
    const Files whole = run("whole");
    Files parts;
    for (int i = 0; i < 2; ++i) parts.merge(run("part" + std::to_string(i), {i, 2}));
    EXPECT_EQ(parts, whole);
}

}  // namespace
}  // namespace gonio
