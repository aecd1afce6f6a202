// Which folder may include which: one way, downward. Linking cannot tell, as all share one include root.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace gonio {
namespace {

namespace fs = std::filesystem;
using Arrows = std::map<std::string, std::set<std::string>>;

// A folder and those that it may include besides itself.
const Arrows& allowed() {
    static const Arrows table = {
        {"ies/core", {}},
        {"ies", {"ies/core"}},
        {"protocol/text", {"ies/core"}},
        {"protocol/schema", {"ies/core", "protocol/text"}},
        {"protocol/timecode", {}},
        {"protocol/net", {}},
        {"protocol/dmx", {"ies", "ies/core", "protocol/schema", "protocol/text", "protocol/timecode"}},
        {"protocol/osc", {"ies/core", "protocol/schema", "protocol/text"}},
        {"protocol/surface", {"ies", "ies/core", "protocol/schema", "protocol/text", "protocol/timecode"}},
        {"client/web", {"protocol/schema"}},
        {"client/relay", {"ies/core"}},
        {"client/connection", {"ies/core", "protocol/schema", "protocol/net"}},
        {"client/cli",
         {"ies", "ies/core", "protocol/schema", "protocol/dmx", "protocol/surface", "client/connection",
          "client/relay"}},
        {"server/base", {"ies/core"}},
        {"server/gl", {"ies/core", "server/base"}},
        {"server/scene",
         {"ies", "ies/core", "protocol/schema", "protocol/dmx", "protocol/osc", "protocol/surface", "protocol/text",
          "protocol/timecode", "server/base"}},
        {"server/assets", {"ies", "ies/core", "protocol/text", "server/base", "server/scene"}},
        {"server/pictures", {"ies/core", "server/assets"}},
        {"server/exchange",
         {"ies", "ies/core", "protocol/schema", "protocol/dmx", "protocol/text", "server/base", "server/scene",
          "server/assets"}},
        {"server/trace", {"ies", "ies/core", "server/base", "server/scene"}},
        {"server/bake", {"ies", "ies/core", "server/base", "server/scene", "server/assets", "server/trace"}},
        {"server/transport", {"ies", "ies/core", "server/base", "server/scene", "server/trace"}},
        {"server/lighting", {"ies", "ies/core", "server/base", "server/scene", "server/trace", "server/transport"}},
        {"server/render",
         {"ies", "ies/core", "protocol/schema", "server/base", "server/gl", "server/scene", "server/trace",
          "server/transport", "server/lighting"}},
        {"server/stream", {"ies/core", "server/base"}},
        {"server/http",
         {"ies/core", "protocol/schema", "protocol/text", "protocol/net", "server/base", "server/stream"}},
        {"server/inputs",
         {"ies/core", "protocol/schema", "protocol/dmx", "protocol/osc", "protocol/text", "protocol/timecode",
          "server/base"}},
        {"server/surfaces",
         {"ies/core", "protocol/schema", "protocol/surface", "protocol/text", "protocol/timecode", "server/base"}},
        {"server/session",
         {"ies",           "ies/core",          "protocol/schema", "protocol/dmx",  "protocol/surface",
          "protocol/text", "protocol/timecode", "server/base",     "server/gl",     "server/scene",
          "server/assets", "server/trace",      "server/lighting", "server/render", "server/stream",
          "server/http",   "server/inputs",     "server/surfaces", "server/show",   "server/exchange"}},
        {"server/show",
         {"ies", "ies/core", "protocol/schema", "protocol/dmx", "protocol/text", "server/base", "server/scene",
          "server/assets"}},
        {"server/sequence",
         {"ies", "ies/core", "protocol/schema", "protocol/timecode", "server/base", "server/scene", "server/assets",
          "server/trace", "server/lighting", "server/render", "server/stream", "server/session", "server/show"}},
        {"server/follow",
         {"ies/core", "protocol/schema", "client/connection", "server/base", "server/scene", "server/assets",
          "server/exchange", "server/trace", "server/lighting", "server/show", "server/session"}},
        {"server/app", {"ies",           "ies/core",        "protocol/schema", "protocol/dmx",   "protocol/surface",
                        "protocol/text", "client/web",      "server/base",     "server/gl",      "server/scene",
                        "server/assets", "server/trace",    "server/lighting", "server/render",  "server/stream",
                        "server/http",   "server/inputs",   "server/surfaces", "server/session", "server/show",
                        "server/bake",   "server/exchange", "server/sequence", "server/follow",  "client/connection"}},
    };
    return table;
}

// Result: the longest folder of the table that the path lies in, "" where none is.
std::string folder_of(const std::string& path, const Arrows& table) {
    for (std::string folder = path; folder.find('/') != std::string::npos;) {
        folder.resize(folder.rfind('/'));
        if (table.contains(folder)) return folder;
    }
    return {};
}

// Result: a sentence for each include of the text that the table does not allow.
std::vector<std::string> forbidden(const std::string& path, const std::string& text, const Arrows& table) {
    static const std::regex include(R"re(^#include "((?:ies|protocol|server|client)/[^"]+)")re");
    std::vector<std::string> found;
    const std::string from = folder_of(path, table);
    std::istringstream lines(text);
    std::smatch match;
    for (std::string line; std::getline(lines, line);) {
        if (!std::regex_search(line, match, include)) continue;
        const std::string to = folder_of(match[1], table);
        if (from.empty() || to.empty() || (from != to && !table.at(from).contains(to)))
            found.push_back(path + " includes " + match[1].str());
    }
    return found;
}

// Result: whether going from a folder along the arrows never comes back to it.
bool is_acyclic(const Arrows& table) {
    std::map<std::string, std::set<std::string>> below = table;
    for (std::size_t round = 0; round < table.size(); ++round)
        for (auto& [folder, reached] : below) {
            const std::set<std::string> now = reached;
            for (const std::string& next : now)
                if (const auto at = below.find(next); at != below.end())
                    reached.insert(at->second.begin(), at->second.end());
        }
    for (const auto& [folder, reached] : below)
        if (reached.contains(folder)) return false;
    return true;
}

TEST(Arrows, EveryIncludeIsAllowed) {
    const fs::path root = GONIO_SOURCE_DIR;
    std::size_t files = 0;
    for (const char* top : {"ies", "protocol", "server", "client"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
            const std::string extension = entry.path().extension();
            if (extension != ".h" && extension != ".cpp") continue;
            std::ostringstream text;
            text << std::ifstream(entry.path()).rdbuf();
            for (const std::string& sentence :
                 forbidden(fs::relative(entry.path(), root).string(), text.str(), allowed()))
                ADD_FAILURE() << sentence;
            ++files;
        }
    }
    EXPECT_GT(files, 300u);
}

TEST(Arrows, PointOneWay) {
    EXPECT_TRUE(is_acyclic(allowed()));
    EXPECT_FALSE(is_acyclic({{"a", {"b"}}, {"b", {"c"}}, {"c", {"a"}}}));
}

TEST(Arrows, AForbiddenIncludeIsFound) {
    EXPECT_EQ(forbidden("server/scene/a.cpp", "#include \"server/gl/objects.h\"\n", allowed()).size(), 1u);
    EXPECT_EQ(forbidden("server/scene/a.cpp", "#include \"server/scene/b.h\"\n#include <vector>\n", allowed()).size(),
              0u);
    EXPECT_EQ(forbidden("server/render/passes/a.cpp", "#include \"server/http/a.h\"\n", allowed()).size(), 1u);
    EXPECT_EQ(forbidden("server/a.h", "#include \"ies/web.h\"\n", allowed()).size(), 1u) << "a folder without a row";
}

}  // namespace
}  // namespace gonio
