// Small MVR shows of heads, and what a test looks for in what they become. For tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/glm.hpp>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "ies/core/zip.h"
#include "protocol/schema/console.pb.h"
#include "server/assets/assets.h"
#include "server/exchange/import_mvr.h"
#include "tests/shared_data.h"
#include "tests/unit/angles.h"
#include "tests/unit/scene/exchange_test_support.h"

namespace gonio::test {

inline constexpr std::size_t kRoom = std::size_t{1} << 30;

inline std::string head_gdtf() {
    const std::string text = gdtf_text(
        {.geometries = "<Geometry Name='Base'><Axis Name='Yoke' Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.3}{0,0,0,1}'>"
                       "<Axis Name='Body'><Beam Name='Lens' LuminousFlux='10000' BeamAngle='25' FieldAngle='40' "
                       "Position='{1,0,0,0}{0,1,0,0}{0,0,1,-0.2}{0,0,0,1}'/></Axis></Axis></Geometry>",
         .modes = mode_text("Base", channel_text("Yoke", "Pan", "1,2", "-270", "270") +
                                        channel_text("Body", "Tilt", "3,4", "-135", "135") +
                                        channel_text("Base", "Dimmer", "5") +
                                        channel_text("Base", "Zoom", "6", "25", "50"))});
    return *write_zip(std::vector<ZipFile>{{"description.xml", text}});
}

inline std::string show_mvr(const std::string& objects, std::vector<ZipFile> files = {}, const std::string& aux = "") {
    files.push_back(
        {"GeneralSceneDescription.xml", "<GeneralSceneDescription verMajor='1' verMinor='6'><Scene><AUXData>" + aux +
                                            "</AUXData><Layers><Layer name='L'><ChildList>" + objects +
                                            "</ChildList></Layer></Layers></Scene></GeneralSceneDescription>"});
    return *write_zip(files);
}

inline std::string fixture(const std::string& name, const std::string& matrix, const std::string& more = "") {
    return "<Fixture name='" + name + "'><Matrix>" + matrix + "</Matrix><GDTFSpec>Maker@Head</GDTFSpec>" + more +
           "</Fixture>";
}

inline std::shared_ptr<SceneAsset> imported(const std::string& bytes) {
    auto scene = exchange::import_mvr(bytes, "show.mvr", {}, kRoom);
    EXPECT_TRUE(scene) << scene.error().text();
    return scene ? *scene : std::make_shared<SceneAsset>();
}

inline bool says(const SceneAsset& scene, const std::string& words) {
    return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                       [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

inline const v1::PatchRow* row_of(const SceneAsset& scene, const std::string& light, const std::string& property) {
    if (!scene.patch) return nullptr;
    for (const v1::PatchRow& row : scene.patch->rows())
        if (row.target() == light && row.property() == property) return &row;
    return nullptr;
}

inline void expect_near(const glm::dvec3& a, const glm::dvec3& b, double most) {
    EXPECT_NEAR(glm::length(a - b), 0.0, most) << a.x << " " << a.y << " " << a.z;
}

// Result: bytes of a file of the shared cases; empty where this machine has none.
inline std::string shared_case_bytes(const std::string& name) {
    const auto path = shared_data("cases/" + name);
    return path ? bytes_of(*path) : "";
}

inline const std::string kHanging = "{1,0,0}{0,1,0}{0,0,1}{1000,2000,5000}";

}  // namespace gonio::test
