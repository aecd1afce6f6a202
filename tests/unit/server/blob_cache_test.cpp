// Files by their content: fetched once, checked, bounded.
#include "server/follow/blob_cache.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "server/base/sha256.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

class CachedBlobs : public testing::Test {
protected:
    void SetUp() override {
        folder = (fs::temp_directory_path() / ("gonio-blobs-" + std::to_string(::getpid()))).string();
        fs::remove_all(folder);
        fs::create_directories(folder);
    }
    void TearDown() override { fs::remove_all(folder); }
    // Result: its hash.
    std::string there(const std::string& content) {
        const std::string hash = sha256(content);
        leader[hash] = content;
        return hash;
    }
    BlobCache cache(std::uint64_t file_bytes = 1000, std::uint64_t all_bytes = 10'000) {
        return {folder, file_bytes, all_bytes,
                [this](const std::string& hash, std::uint64_t most, const BlobCache::Take& take) -> Result<bool> {
                    ++fetched;
                    if (!leader.contains(hash)) return Error{"refused", "HTTP 404", hash, "it is not there"};
                    const std::string& content = leader[hash];
                    if (content.size() > most) return Error{"too_large", hash, "", "it is too large"};
                    for (std::size_t at = 0; at < content.size(); at += 7)
                        if (!take(std::string_view(content).substr(at, 7))) return Error{"given_up", "", "", ""};
                    return true;
                }};
    }
    static std::string text(const std::string& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::size_t files() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    std::string folder;
    std::map<std::string, std::string> leader;
    int fetched = 0;
};

TEST_F(CachedBlobs, AreFetchedOnceAlsoByALaterRun) {
    const std::string hash = there("some light"), empty = there("");
    for (int run = 0; run < 2; ++run) {
        BlobCache one = cache();
        for (int i = 0; i < 2; ++i) {
            const auto path = one.file(hash);
            ASSERT_TRUE(path) << path.error().text();
            EXPECT_EQ(text(*path), "some light");
            EXPECT_EQ(*one.content(hash, 100), "some light");
        }
    }
    EXPECT_EQ(fetched, 1);
    EXPECT_EQ(*cache().content(empty, 100), "");
}

TEST_F(CachedBlobs, OfAnotherHashAreNotKept) {
    const std::string hash = there("some light");
    leader[hash] = "another";
    EXPECT_EQ(cache().file(hash).error().code, "bad_hash");
    EXPECT_EQ(files(), 0u);
    EXPECT_EQ(cache().file(sha256("not there")).error().code, "refused");
    EXPECT_EQ(files(), 0u);
}

TEST_F(CachedBlobs, ThatTheDiskDidNotKeepAreFetchedAgain) {
    const std::string hash = there("some light");
    ASSERT_TRUE(cache().file(hash));
    std::ofstream(folder + "/" + hash) << "torn";
    EXPECT_EQ(*cache().content(hash, 100), "some light");
    std::ofstream(folder + "/" + hash) << "torn";
    const auto scene = cache().folder_of({{"a.glb", hash, 10}});
    ASSERT_TRUE(scene);
    EXPECT_EQ(text(*scene + "/a.glb"), "some light");
    EXPECT_EQ(fetched, 3);
    std::ofstream(folder + "/" + hash) << "SOME LIGHT";  // as long
    const auto again = cache().folder_of({{"a.glb", hash, 10}});
    ASSERT_TRUE(again);
    EXPECT_EQ(text(*again + "/a.glb"), "some light");
    EXPECT_EQ(fetched, 4);
}

TEST_F(CachedBlobs, LeaveWhatIsNotTheirs) {
    const std::string hash = there("some light");
    const std::string backup = folder + "/scene-backup", notes = folder + "/scene-notes.txt";
    fs::create_directories(backup);
    std::ofstream(backup + "/mine.txt") << "precious";
    std::ofstream(notes) << "precious";
    std::ofstream(folder + "/scene-" + hash) << "a file";
    ASSERT_TRUE(cache().folder_of({{"a.glb", hash, 10}}));
    EXPECT_EQ(text(backup + "/mine.txt"), "precious");
    EXPECT_EQ(text(notes), "precious");
    EXPECT_EQ(text(folder + "/scene-" + hash), "a file");
}

TEST_F(CachedBlobs, TheOldestGoesWhereThereAreTooMany) {
    const std::string one = there(std::string(400, 'a')), two = there(std::string(400, 'b')),
                      three = there(std::string(400, 'c'));
    BlobCache bounded = cache(1000, 1000);
    ASSERT_TRUE(bounded.file(one));
    ASSERT_TRUE(bounded.file(two));
    ASSERT_TRUE(bounded.file(one));  // it is used again
    fs::last_write_time(folder + "/" + two, fs::last_write_time(folder + "/" + one) - std::chrono::seconds(1));
    ASSERT_TRUE(bounded.file(three));
    EXPECT_TRUE(fs::exists(folder + "/" + one));
    EXPECT_FALSE(fs::exists(folder + "/" + two));
    EXPECT_TRUE(fs::exists(folder + "/" + three));
    EXPECT_EQ(bounded.file(there(std::string(2000, 'd'))).error().code, "too_large");
    EXPECT_EQ(bounded.content(one, 100).error().code, "too_large");
}

TEST_F(CachedBlobs, AScenesFilesLieUnderTheirPathsAndThoseOfTheLastAreGone) {
    const std::string gltf = there("gltf"), image = there("image");
    BlobCache one = cache();
    const auto first = one.folder_of({{"hall.gltf", gltf, 4}, {"textures/wall.png", image, 5}});
    ASSERT_TRUE(first) << first.error().text();
    EXPECT_EQ(text(*first + "/hall.gltf"), "gltf");
    EXPECT_EQ(text(*first + "/textures/wall.png"), "image");
    const auto second = one.folder_of({{"hall.gltf", image, 5}});
    ASSERT_TRUE(second);
    EXPECT_EQ(text(*second + "/hall.gltf"), "image");
    EXPECT_FALSE(fs::exists(*first));
    EXPECT_EQ(one.folder_of({{"hall.gltf", gltf, 4000}}).error().code, "too_large") << "as it is said to be";
    EXPECT_EQ(one.folder_of({{"a", gltf, 4}, {"b", sha256("none"), 4}}).error().code, "refused");
}

}  // namespace
}  // namespace gonio
