#include "server/exchange/import_luminaire.h"

#include <utility>
#include <vector>

#include "ies/core/zip.h"
#include "protocol/schema/upload_name.h"
#include "server/assets/assets.h"
#include "server/exchange/import_mvr.h"

namespace gonio::exchange {
namespace {

constexpr std::size_t kMostMemory = std::size_t{1} << 30;  // bytes, with its pictures and models

// As the only fixture of a show, which import_mvr() knows all about.
constexpr const char* kShow =
    "<GeneralSceneDescription verMajor='1' verMinor='6'><Scene><Layers><Layer name='Layer'><ChildList>"
    "<Fixture name='Fixture'><GDTFSpec>fixture.gdtf</GDTFSpec></Fixture>"
    "</ChildList></Layer></Layers></Scene></GeneralSceneDescription>";

}  // namespace

Result<std::shared_ptr<const Profile>> read_luminaire(std::string name, std::string_view bytes) {
    if (ending_of(name) != ".gdtf") return make_profile(std::move(name), bytes);
    const auto show = write_zip(
        std::vector<ZipFile>{{"fixture.gdtf", std::string(bytes), false}, {"GeneralSceneDescription.xml", kShow}});
    if (!show) return show.error();
    const auto scene = import_mvr(*show, name, {}, kMostMemory);
    if (!scene) return scene.error();
    const auto& lights = (*scene)->lights;
    if (lights.empty() || !(lights.front().profile->peak_cd > 0.0))
        return Error{"invalid_gdtf", name, "",
                     (*scene)->warnings.empty() ? "the fixture has no beam" : (*scene)->warnings.front()};
    auto own = std::make_shared<Profile>(*lights.front().profile);
    own->name = std::move(name);
    return std::shared_ptr<const Profile>(std::move(own));
}

}  // namespace gonio::exchange
