// The files of a scene inside its show: whole, bounded, and none that leaves its folder.
#include "server/show/held_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "server/base/sha256.h"
#include "server/scene/asset_files.h"
#include "tests/unit/assets_gltf_fixture.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;

class HeldFiles : public testing::Test {
protected:
    void SetUp() override {
        home = fs::path(testing::TempDir()) / ("gonio-held-" + std::to_string(::getpid()));
        fs::remove_all(home);
        fs::create_directories(home / "here" / "parts");
        fs::create_directories(home / "there");
        Json room = triangle();
        write("parts/wall.bin", bytes_of({0, 0, 0, 1, 0, 0, 0, 1, 0}));
        room["buffers"][0]["uri"] = "parts/wall.bin";
        write("room.gltf", room.dump());
    }
    void TearDown() override { fs::remove_all(home); }
    void write(const std::string& name, const std::string& bytes) const {
        std::ofstream(home / "here" / name, std::ios::binary) << bytes;
    }
    std::shared_ptr<const SceneAsset> load() const {
        auto asset = load_scene((home / "here" / "room.gltf").string());
        EXPECT_TRUE(asset) << asset.error().text();
        return asset ? *asset : nullptr;
    }
    static void add(saved::Show& show, const std::string& path, const std::string& content) {
        saved::HeldFile& file = *show.add_files();
        file.set_path(path);
        file.set_sha256(sha256(content));
        file.set_content(content);
    }
    bool nothing_is_left() const { return fs::is_empty(home / "there"); }
    fs::path home;
};

TEST_F(HeldFiles, ASceneOfSeveralFilesIsTheSameElsewhere) {
    const auto asset = load();
    EXPECT_EQ(why_not_held(*asset), "");
    saved::Show show;
    ASSERT_EQ(hold_files(*asset, true, show), "");
    ASSERT_EQ(show.files_size(), 2);
    EXPECT_EQ(show.files(0).path(), "room.gltf") << "the scene's own first";
    fs::remove_all(home / "here");
    std::shared_ptr<const SceneAsset> there;
    {
        const auto folder = unpack_files(show, (home / "there").string());
        ASSERT_TRUE(folder) << folder.error().text();
        auto read = load_scene((*folder)->path() + "/" + show.files(0).path(), asset->name);
        ASSERT_TRUE(read) << read.error().text();
        there = with_folder(*read, *folder);
    }
    EXPECT_EQ(there->name, asset->name);
    EXPECT_EQ(there->triangles(), 1u);
    saved::Show again;
    EXPECT_EQ(hold_files(*there, true, again), "") << "the files are there while the scene is";
    EXPECT_EQ(again.SerializeAsString(), show.SerializeAsString());
    EXPECT_EQ(held_key(again), held_key(show));
    there = nullptr;
    EXPECT_TRUE(nothing_is_left());
}

TEST_F(HeldFiles, BuiltInScenesNeedNone) {
    const auto asset = load_scene("cornell");
    ASSERT_TRUE(asset);
    saved::Show show;
    EXPECT_EQ(why_not_held(**asset), "");
    EXPECT_EQ(hold_files(**asset, true, show), "");
    EXPECT_EQ(show.files_size(), 0);
    EXPECT_EQ(held_key(show), "");
}

TEST_F(HeldFiles, WhatWasChangedSinceIsSaid) {
    const auto asset = load();
    write("parts/wall.bin", bytes_of({0, 0, 0, 2, 0, 0, 0, 2, 0}));
    saved::Show show;
    EXPECT_EQ(hold_files(*asset, true, show), "the scene's file 'parts/wall.bin' was changed since it was loaded");
    EXPECT_EQ(show.files_size(), 0) << "all or none";
    fs::remove(home / "here" / "parts" / "wall.bin");
    EXPECT_NE(hold_files(*asset, true, show).find("'parts/wall.bin' cannot be read"), std::string::npos);
}

TEST_F(HeldFiles, WhatIsTooLargeIsSaidBeforeItIsRead) {
    auto large = std::make_shared<SceneAsset>(*load());
    auto files = std::make_shared<AssetFiles>(*large->files);
    files->files[0].bytes = kMostHeldBytes;
    large->files = files;
    saved::Show show;
    EXPECT_EQ(why_not_held(*large), "the scene's files have 129 MiB, and a show holds 128 MiB at most");
    EXPECT_EQ(hold_files(*large, true, show), why_not_held(*large));
    large->files = nullptr;
    EXPECT_NE(why_not_held(*large), "");
}

TEST_F(HeldFiles, NoneLeavesItsFolder) {
    for (const std::string path : {"../out.bin", "/tmp/out.bin", "a/../../out.bin", "", ".", "a\\b", "a//b"}) {
        saved::Show show;
        add(show, "room.gltf", "{}");
        add(show, path, "x");
        const auto folder = unpack_files(show, (home / "there").string());
        ASSERT_FALSE(folder) << path;
        EXPECT_EQ(folder.error().code, "bad_state") << path;
        EXPECT_TRUE(nothing_is_left()) << path;
    }
}

TEST_F(HeldFiles, DamageIsFound) {
    saved::Show show;
    add(show, "room.gltf", "{}");
    add(show, "room.gltf", "{}");
    EXPECT_EQ(unpack_files(show, (home / "there").string()).error().code, "bad_state") << "twice";
    show.mutable_files()->RemoveLast();
    show.mutable_files(0)->set_content("{ }");
    const auto folder = unpack_files(show, (home / "there").string());
    ASSERT_FALSE(folder);
    EXPECT_EQ(folder.error().value, "room.gltf");
    EXPECT_TRUE(nothing_is_left());
}

TEST_F(HeldFiles, ALinkedFileStaysWhenAnotherTakesItsName) {
    write("lamp.ies", "first");
    write("room.gltf", "{}");
    const auto held = link_files((home / "here").string(), "lamp.ies");
    ASSERT_TRUE(held) << held.error().text();
    EXPECT_FALSE(fs::exists(fs::path((*held)->path()) / "room.gltf")) << "it needs nothing beside it";
    const auto with_others = link_files((home / "here").string(), "room.gltf");
    ASSERT_TRUE(with_others) << with_others.error().text();
    EXPECT_TRUE(fs::exists(fs::path((*with_others)->path()) / "lamp.ies"));
    write("new", "second");
    fs::rename(home / "here" / "new", home / "here" / "lamp.ies");  // as an upload appears
    std::string text;
    std::ifstream(fs::path((*held)->path()) / "lamp.ies") >> text;
    EXPECT_EQ(text, "first");
}

}  // namespace
}  // namespace gonio
