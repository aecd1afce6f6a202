// Folders that killed processes leave go with the next one; those of living ones stay.
#include "server/base/own_folder.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace gonio {
namespace {

namespace fs = std::filesystem;

class OwnFolders : public testing::Test {
protected:
    void SetUp() override {
        parent = fs::path(testing::TempDir()) / ("gonio-own-" + std::to_string(::getpid()));
        fs::remove_all(parent);
        fs::create_directories(parent);
    }
    void TearDown() override { fs::remove_all(parent); }
    std::set<std::string> names() const {
        std::set<std::string> all;
        for (const auto& entry : fs::directory_iterator(parent)) all.insert(entry.path().filename().string());
        return all;
    }
    // Made by a process that is gone without having removed it.
    std::string left() const {
        int answers[2];
        EXPECT_EQ(::pipe(answers), 0);
        const pid_t child = ::fork();
        if (child == 0) {
            const auto own = make_own_folder(parent.string(), "part");
            if (!own) ::_exit(1);
            std::ofstream(own->path + "/file") << "of the process";
            ::_exit(::write(answers[1], own->path.data(), own->path.size()) < 0);
        }
        int status = 1;
        ::waitpid(child, &status, 0);
        EXPECT_EQ(status, 0);
        char text[4096];
        const ssize_t length = ::read(answers[0], text, sizeof text);
        ::close(answers[0]);
        ::close(answers[1]);
        return {text, static_cast<std::size_t>(length)};
    }
    fs::path parent;
};

TEST_F(OwnFolders, OfAProcessThatWasKilledGoAndOthersStay) {
    const auto living = make_own_folder(parent.string(), "part");
    ASSERT_TRUE(living) << living.error().text();
    EXPECT_EQ(fs::status(living->path).permissions(), fs::perms::owner_all);
    const std::string gone = left();
    ASSERT_TRUE(fs::exists(gone + "/file"));
    EXPECT_TRUE(fs::exists(living->path)) << "the other process has seen it too";
    const auto next = make_own_folder(parent.string(), "part");
    ASSERT_TRUE(next);
    EXPECT_FALSE(fs::exists(gone));
    EXPECT_TRUE(fs::exists(living->path));
    EXPECT_TRUE(fs::exists(next->path));
}

TEST_F(OwnFolders, OfAnotherNameAndWhatIsNoFolderStay) {
    fs::create_directories(parent / "elsewhere");
    std::ofstream(parent / "elsewhere/file") << "x";
    for (const char* folder : {"part-abc", "part-abcdefg", "parts-abcdef", "partabcdef", "other-abcdef"})
        fs::create_directories(parent / folder);
    std::ofstream(parent / "part-abcdef") << "a file";
    fs::create_directory_symlink(parent / "elsewhere", parent / "part-abcdeg");
    const std::set<std::string> before = names();
    const auto own = make_own_folder(parent.string(), "part");
    ASSERT_TRUE(own);
    std::set<std::string> after = names();
    after.erase(fs::path(own->path).filename().string());
    EXPECT_EQ(after, before);
    EXPECT_TRUE(fs::exists(parent / "elsewhere/file"));
}

TEST_F(OwnFolders, ManyAtOnceTakeNoneFromEachOther) {
    std::vector<std::thread> starts;
    std::vector<OwnFolder> all(40);
    for (OwnFolder& mine : all)
        starts.emplace_back([&] {
            auto own = make_own_folder(parent.string(), "part");
            ASSERT_TRUE(own) << own.error().text();
            mine = std::move(*own);
        });
    for (std::thread& start : starts) start.join();
    for (const OwnFolder& mine : all) EXPECT_TRUE(fs::exists(mine.path)) << mine.path;
    EXPECT_EQ(names().size(), all.size());
}

TEST_F(OwnFolders, WhereNoneCanBeMadeItIsSaid) {
    const auto own = make_own_folder((parent / "missing").string(), "part");
    ASSERT_FALSE(own);
    EXPECT_EQ(own.error().code, "file_unwritable");
    EXPECT_NE(own.error().value.find("missing"), std::string::npos);
}

}  // namespace
}  // namespace gonio
