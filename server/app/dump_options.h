// What a program's options are, as JSON: packaging/option_texts.py makes man pages and completions of it. Only for .cpp
// files, because it brings CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

namespace gonio {

// Result: {"names", "value", "choices", "many", "help", "default", "group"}; value: "" of a flag, else what the help
// calls it.
inline nlohmann::ordered_json dump_option(const CLI::Option& option) {
    using Json = nlohmann::ordered_json;
    Json names = Json::array(), choices = Json::array();
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    if (names.empty()) names.push_back(option.get_name());  // a word without dashes
    const std::string type = option.get_type_name();        // "TEXT:{a,b}", "INT:INT in [0 - 64]"
    const bool flag = option.get_items_expected_max() == 0;
    if (const auto begin = type.find('{'); begin != std::string::npos && type.find("->") == std::string::npos)
        for (const std::string& one : CLI::detail::split(type.substr(begin + 1, type.find('}') - begin - 1), ','))
            choices.push_back(one);
    return {{"names", names},
            {"value", flag ? "" : type.substr(0, type.find(':'))},
            {"choices", choices},
            {"many", option.get_items_expected_max() > 1},
            {"help", option.get_description()},
            {"default", flag ? "" : option.get_default_str()},
            {"group", option.get_group()}};
}

// Options of a hidden group are left out. Result: one line.
inline std::string dump_options(const CLI::App& app, const std::string& program, const std::string& version) {
    using Json = nlohmann::ordered_json;
    const auto options_of = [](const CLI::App& of) {
        Json options = Json::array();
        for (const CLI::Option* option : of.get_options())
            if (!option->get_group().empty()) options.push_back(dump_option(*option));
        return options;
    };
    Json commands = Json::array();
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        commands.push_back({{"name", command->get_name()},
                            {"help", command->get_description()},
                            {"names", Json::array()},
                            {"options", options_of(*command)}});
    return Json{{"program", program},
                {"version", version},
                {"help", app.get_description()},
                {"options", options_of(app)},
                {"commands", commands}}
        .dump();
}

}  // namespace gonio
