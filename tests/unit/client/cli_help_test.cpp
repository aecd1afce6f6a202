// The table of gonio's commands: each has help and can be said, and what README and docs show can be said too.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "client/cli/cli.h"
#include "client/cli/commands.h"
#include "protocol/schema/words.h"
#include "tests/unit/split.h"

namespace gonio {
namespace {

struct Outcome {
    int code;
    std::string out, err;
};
Outcome run(const std::string& line) {
    std::ostringstream out, err;
    const int code = run_cli(split(line), out, err);
    return {code, out.str(), err.str()};
}

std::string sample(WordForm form) {
    switch (form) {
        case WordForm::vector:
            return "1,2,3";
        case WordForm::size:
            return "8x6";
        case WordForm::picture:
            return "a.png";
        case WordForm::scene_file:
            return "a.glb";
        case WordForm::on_or_off:
            return "on";
        case WordForm::text:
        case WordForm::names:
            return "a";
        case WordForm::range:
            return "1:2";
        default:
            return "1";
    }
}

TEST(CliHelp, EveryCommandHasHelpAndCanBeSaid) {
    const Outcome all = run("--help");
    EXPECT_EQ(all.code, 0);
    for (const WordCommand& command : cli_commands()) {
        const std::string name(command.name);
        EXPECT_NE(all.out.find("\n  " + name), std::string::npos) << name;
        EXPECT_FALSE(command.help.empty()) << name;
        const Outcome help = run(name + " --help");
        EXPECT_EQ(help.code, 0) << name;
        EXPECT_EQ(help.out.rfind("usage: gonio " + name, 0), 0u) << help.out;
        std::vector<std::string> words = split(name);
        for (const auto rows : {command.names, command.options})
            for (const WordRow& row : rows) {
                EXPECT_FALSE(row.help.empty()) << name << " " << row.name;
                EXPECT_NE(help.out.find("\n  " + std::string(row.name)), std::string::npos) << name << " " << row.name;
                if (row.name.starts_with("--")) words.emplace_back(row.name);
                if (row.form != WordForm::flag) words.push_back(sample(row.form));
            }
        const ReadWords read = read_command_line(words);
        EXPECT_FALSE(read.fault) << name << ": " << read.fault->text();
        EXPECT_EQ(read.options.size(), command.options.size()) << name;
    }
    for (const WordRow& option : cli_options()) EXPECT_NE(all.out.find(option.name), std::string::npos);
    EXPECT_NE(run("set --help").out.find("\n  set exposure [EV]"), std::string::npos);
    EXPECT_EQ(run("set --help").out.find("add light"), std::string::npos);
}

TEST(CliHelp, MistypedWordsAreRecognised) {
    const std::pair<const char*, const char*> cases[] = {
        {"mter", "meter"},
        {"set lihgt key", "light"},
        {"preset recal look", "recall"},
        {"set light key --levl 1", "--level"},
        {"set light key --postion=1,2,3", "--position"},
        {"stats --jsn", "--json"},
    };
    for (const auto& [line, meant] : cases) {
        const Outcome refused = run(line);
        EXPECT_EQ(refused.code, 2) << line;
        EXPECT_NE(refused.err.find("Did you mean " + std::string(meant) + "?"), std::string::npos) << refused.err;
    }
    for (const char* line : {"fly", "set x", "meter --x 1,0,0"})
        EXPECT_EQ(run(line).err.find("Did you mean"), std::string::npos) << line;
}

// What people type who know other programs.
TEST(CliHelp, HabitsOfOtherProgramsGetAHint) {
    const std::pair<const char*, const char*> cases[] = {
        {"info", "gonio get"},
        {"list", "gonio light list"},
        {"delete key", "gonio remove light"},
        {"lights", "gonio light list"},
        {"render a.png", "gonio capture"},
        {"go", "gonio cue go"},
        {"blackout", "gonio set master 0"},
        {"master 0.5", "gonio set master"},
    };
    for (const auto& [line, use] : cases) {
        const Outcome refused = run(line);
        EXPECT_EQ(refused.code, 2) << line;
        EXPECT_NE(refused.err.find("Use: " + std::string(use)), std::string::npos) << refused.err;
    }
}

TEST(CliHelp, JsonCountsBehindAFault) {
    for (const char* line : {"set light key --level high --json", "--json set light key --level", "fly away --json",
                             "set light key --level --json", "--shine 1 stats --json"}) {
        const Outcome refused = run(line);
        EXPECT_EQ(refused.code, 2) << line;
        EXPECT_EQ(refused.out.rfind("{\"code\":\"usage\"", 0), 0u) << line << ": " << refused.out;
    }
}

TEST(CliHelp, RatiosMayBePercentages) {
    EXPECT_EQ(command_from_words(split("set light key --level 7%"))->set_light().level_ratio(), 0.07);
    EXPECT_EQ(command_from_words(split("set master 50%"))->set_master().ratio(), 0.5);
    EXPECT_EQ(command_from_words(split("set light key --level -50%"))->set_light().level_ratio(), -0.5);
    for (const char* line : {"set master %", "set master 5%%", "set exposure 5%", "set light key --pan 5%"})
        EXPECT_FALSE(command_from_words(split(line))) << line;
}

TEST(CliHelp, NamesMayLookLikeCommands) {
    const auto group = command_from_words(split("group wash get set [a,b] -- --json"));
    ASSERT_TRUE(group) << group.error().text();
    EXPECT_EQ(group->set_group().lights_size(), 4);
    EXPECT_EQ(group->set_group().lights(2), "[a,b]");
    EXPECT_EQ(read_command_line(split("set light light --level 1")).message.command().set_light().name(), "light");
}

TEST(CliHelp, TheRevisionOfAChangeMayStandAnywhere) {
    for (const char* line : {"set master 1 --base-rev 7", "set --base-rev=7 master 1", "--base-rev 7 master 1"})
        EXPECT_EQ(command_from_words(split(line))->base_rev(), 7u) << line;
    EXPECT_EQ(run("get --base-rev 7").code, 2);
    EXPECT_EQ(run("set master 1 --base-rev soon").code, 2);
    EXPECT_FALSE(command_from_words(split("load scene hall.glb --upload"))) << "a job has nobody to send it to";
}

// Result: the commands of a line of a shell, each as its words: quotes joined, comments and files of output left out.
std::vector<std::vector<std::string>> shell_commands(const std::string& line) {
    std::vector<std::vector<std::string>> commands(1);
    std::string word;
    bool quoted = false;
    for (const char c : line + " ") {
        if (c == '"') {
            quoted = !quoted;
        } else if (quoted || (c != ' ' && c != ';')) {
            word += c;
        } else {
            if (word.starts_with('#')) break;
            const bool file = !commands.back().empty() && commands.back().back() == ">";
            if (file && !word.empty()) {
                commands.back().pop_back();
                word.clear();
            }
            const bool joint = word == "&&" || word == "|";
            if (!word.empty() && !joint) commands.back().push_back(word);
            if (c == ';' || joint) commands.emplace_back();
            word.clear();
        }
    }
    return commands;
}

TEST(CliHelp, TheDocsCommandsCanBeSaid) {
    namespace fs = std::filesystem;
    const fs::path root = GONIO_SOURCE_DIR;
    std::vector<fs::path> pages = {root / "README.md"};
    for (const auto& entry : fs::recursive_directory_iterator(root / "docs"))
        if (entry.path().extension() == ".md") pages.push_back(entry.path());
    unsigned said = 0;
    for (const fs::path& page : pages) {
        std::ifstream file(page);
        bool code = false;
        for (std::string line; std::getline(file, line);) {
            if (line.starts_with("```")) code = !code;
            if (!code || !line.starts_with("gonio ") || line.find("…") != line.npos) continue;
            for (const auto& words : shell_commands(line)) {
                if (words.empty() || words.front() != "gonio") continue;
                const ReadWords read = read_command_line(std::span(words).subspan(1));
                EXPECT_FALSE(read.fault) << page << ": " << line << ": " << read.fault->text();
                ++said;
            }
        }
    }
    EXPECT_GT(said, 30u) << "the pages have moved";
}

}  // namespace
}  // namespace gonio
