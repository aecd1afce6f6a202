// The scene that goniod begins with, where a show was saved: found again however a client had named it.
#include "server/app/start.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/console.pb.h"
#include "server/base/atomic_file.h"
#include "server/scene/apply.h"
#include "server/scene/imported.h"
#include "server/scene/scene.h"
#include "server/show/saved_show.h"
#include "server/show/state_file.h"
#include "tests/unit/assets_gltf_fixture.h"
#include "tests/unit/scene/mvr_shows.h"

namespace gonio {
namespace {

class FirstScene : public GltfFixture {
protected:
    void SetUp() override {
        GltfFixture::SetUp();
        write("room.gltf", triangle().dump());
        options.state_file = directory_.parent_path() / "show.json";
    }
    // Saves what a client did who loaded room.gltf under this name. Result: the scene's name in the file.
    std::string save(const std::string& name, double scale = 1.0) {
        auto asset = load_scene(directory_ / "room.gltf", name, {.scale = scale});
        EXPECT_TRUE(asset) << asset.error().text();
        Scene scene = scene_of(*asset, 5);
        v1::Command command;
        command.mutable_set_camera()->set_fov_rad(1.25);
        EXPECT_TRUE(apply(scene, command, {}));
        ProfileTexts texts;
        const saved::Show show = show_of(scene, texts);
        std::ofstream(options.state_file) << write_show(show);
        return show.scene();
    }
    static std::string read(const std::string& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    bool set_aside() const { return std::filesystem::exists(options.state_file + ".aside"); }

    Options options;
};

TEST_F(FirstScene, AnUploadComesBackFromItsFolder) {
    options.upload_folder = directory_;
    ASSERT_EQ(save("upload:room.gltf"), "upload:room.gltf");
    const Scene scene = first_scene(options);
    EXPECT_EQ(scene.asset->name, "upload:room.gltf") << "clients see the name that they gave";
    EXPECT_EQ(scene.asset->triangles(), 1u);
    EXPECT_EQ(scene.camera.fov_rad, 1.25);
    EXPECT_FALSE(set_aside());
}

// After a restart without --upload-dir, and after a show was opened that held its scene, the scene is nowhere else.
TEST_F(FirstScene, ASceneThatIsNowhereElseComesBackFromBesideTheState) {
    namespace fs = std::filesystem;
    const fs::path state = options.state_file, uploads = directory_ / "uploads";
    fs::create_directories(uploads);
    fs::copy_file(directory_ / "room.gltf", uploads / "room.gltf");
    const auto beside = [&] {
        int count = 0;
        for (const auto& entry : fs::directory_iterator(state.parent_path()))
            count += entry.path().filename().string().starts_with("show.json.scene-");
        return count;
    };
    const auto save_state = [&](const Scene& scene) {
        StateFile file(options.state_file);
        file.put(scene);
        file.close();
    };
    auto asset = load_scene(uploads / "room.gltf", "upload:room.gltf");
    ASSERT_TRUE(asset) << asset.error().text();
    save_state(scene_of(*asset, 5));
    EXPECT_LT(fs::file_size(state), 20'000u) << "the scene is not written with each change";
    fs::remove_all(uploads);
    for (int restart = 0; restart < 2; ++restart) {
        const Scene scene = first_scene(options);
        EXPECT_EQ(scene.asset->name, "upload:room.gltf");
        EXPECT_EQ(scene.asset->triangles(), 1u);
        EXPECT_FALSE(set_aside());
        save_state(scene);
        EXPECT_EQ(beside(), 1);
    }
    // A damaged one is no scene: what there is of the show stays aside.
    for (const auto& entry : fs::directory_iterator(state.parent_path()))
        if (entry.path().filename().string().starts_with("show.json.scene-")) fs::resize_file(entry.path(), 40);
    EXPECT_EQ(first_scene(options).asset->name, "cornell");
    EXPECT_TRUE(set_aside());
    fs::remove(options.state_file + ".aside");
    auto cornell = load_scene("cornell");
    ASSERT_TRUE(cornell);
    save_state(scene_of(*cornell, 9));
    EXPECT_EQ(beside(), 0) << "none is left of a scene that is gone";
}

TEST_F(FirstScene, AnUploadThatIsGoneIsSetAside) {
    for (const char* folder : {"", "scene"}) {  // the private one; one without the file
        options.upload_folder = *folder ? (directory_ / folder).string() : "";
        save("upload:room.gltf");
        const Scene scene = first_scene(options);
        EXPECT_EQ(scene.asset->name, "cornell") << folder;
        EXPECT_TRUE(set_aside()) << folder;
        std::filesystem::remove(options.state_file + ".aside");
    }
    // No name leaves the folder.
    options.upload_folder = directory_ / "uploads";
    std::filesystem::create_directory(options.upload_folder);
    save("upload:../room.gltf");
    EXPECT_EQ(first_scene(options).asset->name, "cornell");
    EXPECT_TRUE(set_aside());
}

// One thing of the show cannot be brought back: the next save must not be the end of it.
TEST_F(FirstScene, APartOfAShowIsKeptAsideWhole) {
    const std::string path = std::filesystem::canonical(directory_ / "room.gltf");
    save(path);
    saved::Show show = *read_show(read(options.state_file));
    show.set_technique("no such technique");
    const std::string broken = write_show(show);
    std::ofstream(options.state_file) << broken;
    options.oneshot = "job.json";
    EXPECT_EQ(first_scene(options).camera.fov_rad, 1.25) << "the rest comes back";
    EXPECT_FALSE(set_aside()) << "a job saves nothing";
    options.oneshot.clear();
    options.patch_file = directory_ / "none.toml";
    EXPECT_THROW(first_scene(options), std::invalid_argument);
    EXPECT_FALSE(set_aside()) << "nor does a start that fails";
    options.patch_file.clear();
    for (int i = 0; i < 2; ++i) EXPECT_EQ(first_scene(options).camera.fov_rad, 1.25);
    EXPECT_EQ(read(options.state_file), broken) << "the next start has it too, should this one end before it saves";
    EXPECT_FALSE(std::filesystem::exists(options.state_file + ".aside-2")) << "the same one";
    ASSERT_TRUE(write_file_atomically(options.state_file, "the next save"));
    EXPECT_EQ(read(options.state_file + ".aside"), broken);
}

TEST_F(FirstScene, ANameBelowASceneRootComesBack) {
    options.scene_roots = {directory_};
    ASSERT_EQ(save("room.gltf"), "room.gltf");
    const Scene scene = first_scene(options);
    EXPECT_EQ(scene.asset->name, "room.gltf");
    EXPECT_EQ(scene.camera.fov_rad, 1.25);
    EXPECT_FALSE(set_aside());
}

TEST_F(FirstScene, TheScaleComesBack) {
    const std::string path = std::filesystem::canonical(directory_ / "room.gltf");
    save(path, 4.0);
    const auto side_m = [](const Scene& scene) { return scene.asset->bounds.max.x - scene.asset->bounds.min.x; };
    Scene scene = first_scene(options);
    EXPECT_EQ(side_m(scene), 4.0);
    EXPECT_EQ(scene.camera.fov_rad, 1.25);
    EXPECT_FALSE(set_aside());
    options.scene = path;
    options.scene_given = true;
    EXPECT_EQ(side_m(first_scene(options)), 4.0) << "the same scene, so the same scale";
    // Asked for another one: what was saved stands elsewhere.
    options.load.scale = 2.0;
    options.scale_given = true;
    scene = first_scene(options);
    EXPECT_EQ(side_m(scene), 2.0);
    EXPECT_NE(scene.camera.fov_rad, 1.25);
    EXPECT_TRUE(set_aside());
}

// Address 513 of the file is universe 2, slot 1; an offset of 10 makes it universe 12.
TEST_F(FirstScene, TheUniverseOffsetComesBackWithAndWithoutThePatchOfTheFile) {
    const std::string path = (directory_ / "show.mvr").string();
    std::ofstream(path, std::ios::binary) << test::show_mvr(
        test::fixture("Spot", test::kHanging, "<Addresses><Address break='0'>513</Address></Addresses>"),
        {{"Maker@Head.gdtf", test::head_gdtf()}});
    auto asset = exchange::load_any_scene(path, "", {.universe_offset = 10}, test::kRoom);
    ASSERT_TRUE(asset) << asset.error().text();
    Scene scene = scene_of(*asset, 5);
    const auto restart = [&] {
        ProfileTexts texts;
        std::ofstream(options.state_file) << write_show(show_of(scene, texts));
        return first_scene(options);
    };
    const auto universe_of_file = [](const Scene& restored) {
        const v1::PatchRow* row = test::row_of(*restored.asset, "Spot", "level");
        return row == nullptr ? 0u : row->universe();
    };
    const Scene untouched = restart();
    EXPECT_EQ(untouched.asset->imported->universe_offset, 10);
    EXPECT_EQ(universe_of_file(untouched), 12u);
    ASSERT_NE(untouched.patch, nullptr);
    EXPECT_EQ(untouched.patch->rows(0).universe(), 12u);
    v1::Command command;
    command.mutable_set_patch()->set_use_default(true);
    ASSERT_TRUE(apply(scene, command, {}));
    const Scene by_default = restart();
    EXPECT_EQ(by_default.patch, nullptr) << "the default patch was chosen";
    EXPECT_EQ(by_default.asset->imported->universe_offset, 10);
    EXPECT_EQ(universe_of_file(by_default), 12u) << "the file's patch, should somebody choose it again";
    options.load.universe_offset = 3;
    EXPECT_EQ(universe_of_file(restart()), 12u) << "the saved offset counts";
}

// Roots bind clients; goniod itself was started with this scene.
TEST_F(FirstScene, AFileOutsideTheSceneRootsComesBack) {
    options.scene_roots = {directory_ / "elsewhere"};
    const std::string path = std::filesystem::canonical(directory_ / "room.gltf");
    ASSERT_EQ(save(path), path);
    EXPECT_EQ(first_scene(options).camera.fov_rad, 1.25);
    EXPECT_FALSE(set_aside());
}

TEST_F(FirstScene, GelsOfAFileAreThereAndABadLineEndsTheStart) {
    const std::string file = (directory_.parent_path() / "gels.csv").string();
    std::ofstream(file) << "Straw, 0.72, 0.485, 0.428, 0.4234, 0.3990\n";
    options.state_file.clear();
    options.scene = "cornell";
    options.gel_file = file;
    Scene scene = first_scene(options);
    v1::Command command;
    command.mutable_set_light()->set_name(scene.lights[0].name);
    command.mutable_set_light()->set_gel("Straw");
    ASSERT_TRUE(apply(scene, command, {}));
    // A saved show finds it again; without the file the light has none.
    options.state_file = (directory_.parent_path() / "gel-show.json").string();
    ProfileTexts texts;
    std::ofstream(options.state_file) << write_show(show_of(scene, texts));
    Revision restored = 0;
    const Scene again = first_scene(options, &restored);
    ASSERT_TRUE(again.lights[0].gel);
    EXPECT_EQ(again.lights[0].gel->name, "Straw");
    EXPECT_EQ(restored, scene.scene_rev);
    options.gel_file.clear();
    EXPECT_FALSE(first_scene(options).lights[0].gel);
    std::ofstream(file) << "Straw, 7\n";
    options.gel_file = file;
    try {
        first_scene(options);
        ADD_FAILURE() << "it must not start";
    } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("line 1"), std::string::npos) << error.what();
    }
}

TEST_F(FirstScene, ShowsLieBesideTheStateFileUnlessSaid) {
    options.state_file = "/var/lib/goniod/show.json";
    EXPECT_EQ(show_folder(options), "/var/lib/goniod/shows");
    options.show_folder = "/srv/shows";
    EXPECT_EQ(show_folder(options), "/srv/shows");
    options.show_folder = options.state_file = "";
    EXPECT_EQ(show_folder(options), "");
}

}  // namespace
}  // namespace gonio
