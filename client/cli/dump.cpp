#include <nlohmann/json.hpp>

#include "client/cli/commands.h"

namespace gonio {
namespace {

using Json = nlohmann::ordered_json;

// As server/app/dump_options.h has them of goniod.
Json dump_row(const WordRow& row) {
    const bool is_option = row.name.starts_with("-"), either = row.form == WordForm::on_or_off;
    Json names = Json::array({row.name});
    if (row.name == "--help") names.insert(names.begin(), "-h");
    return {{"names", names},
            {"value", is_option ? row.metavar : row.name},
            {"choices", either ? Json::array({"on", "off"}) : Json::array()},
            {"many", row.name.find("…") != std::string_view::npos},
            {"help", std::string(row.form == WordForm::degrees ? "degrees, " : "") + std::string(row.help)},
            {"default", ""},
            {"group", "Options"}};
}

Json dump_rows(std::span<const WordRow> rows) {
    Json result = Json::array();
    for (const WordRow& row : rows) result.push_back(dump_row(row));
    return result;
}

}  // namespace

std::string dump_words() {
    Json commands = Json::array();
    for (const WordCommand& command : cli_commands()) {
        Json options = dump_rows(command.options);
        if (command.message.starts_with("command."))
            for (const WordRow& row : change_options()) options.push_back(dump_row(row));
        commands.push_back({{"name", command.name},
                            {"help", command.help},
                            {"names", dump_rows(command.names)},
                            {"options", options}});
    }
    return Json{{"program", "gonio"},
                {"version", GONIO_VERSION},
                {"help", "gonio: drives a goniod, the lighting-previsualisation server"},
                {"options", dump_rows(cli_options())},
                {"commands", commands}}
        .dump();
}

}  // namespace gonio
