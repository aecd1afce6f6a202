#include "server/app/config.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <numeric>
#include <optional>

#include "ies/core/number_text.h"
#include "protocol/text/toml_read.h"
#include "server/base/bounded_file.h"

namespace gonio {
namespace {

constexpr std::string_view kPrefix = "GONIOD_";

std::string key_of(const CLI::Option& option) {
    return option.get_lnames().empty() ? std::string() : option.get_lnames().front();
}

std::string variable_of(const std::string& key) {
    std::string name(kPrefix);
    for (const char c : key) name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return name;
}

bool is_flag(const CLI::Option& option) {
    return option.get_items_expected_max() == 0;
}

bool takes_many(const CLI::Option& option) {
    return option.get_items_expected_max() > 1;
}

bool is_number(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    return type.starts_with("INT") || type.starts_with("UINT") || type.starts_with("FLOAT");
}

std::optional<std::string> variable(char** environment, const std::string& name) {
    for (char** entry = environment; entry != nullptr && *entry != nullptr; ++entry) {
        const std::string_view text = *entry;
        if (text.size() > name.size() && text.starts_with(name) && text[name.size()] == '=')
            return std::string(text.substr(name.size() + 1));
    }
    return std::nullopt;
}

// How many letters must be inserted, removed or replaced (Levenshtein).
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t above = row[j + 1];
            row[j + 1] = std::min({above + 1, row[j] + 1, diagonal + (a[i] == b[j] ? 0 : 1)});
            diagonal = above;
        }
    }
    return row.back();
}

class Completion {
public:
    Completion(CLI::App& app, const std::vector<std::string>& arguments, char** environment)
        : app_(app), environment_(environment) {
        result_.arguments = arguments;
        for (CLI::Option* option : app.get_options()) {
            if (!option->get_configurable() || key_of(*option).empty()) continue;
            options_[key_of(*option)] = option;
            for (const std::string& name : option->get_lnames()) names_[name] = key_of(*option);
        }
    }

    Settings run() {
        // What is given must be known before trial values are set.
        std::vector<std::string> given;
        for (const auto& [key, option] : options_)
            if (option->count() > 0) given.push_back(key);
        std::string file;
        const CLI::Option* config = app_.get_option_no_throw("--config");
        if (config != nullptr && config->count() > 0) file = config->as<std::string>();
        if (file.empty()) file = variable(environment_, variable_of("config")).value_or("");
        if (!file.empty()) read_file(file);
        read_environment();
        for (const auto& [key, value] : values_) {
            if (std::find(given.begin(), given.end(), key) != given.end()) continue;
            result_.sources[key] = value.source;
            for (const std::string& text : value.texts) {
                const bool flag = is_flag(*options_.at(key));
                if (flag && text != "true") continue;
                const bool joined = !flag && !text.empty();  // CLI11 takes "--key=" for a key without a value
                result_.arguments.push_back("--" + key + (joined ? "=" + text : ""));
                if (!flag && text.empty()) result_.arguments.emplace_back();
            }
        }
        return std::move(result_);
    }

private:
    struct Value {
        std::vector<std::string> texts;
        std::string source;
    };

    // Whether the option takes the value: what it would say of it on the command line.
    void take(const std::string& key, Value value) {
        CLI::Option& option = *options_.at(key);
        try {
            if (is_flag(option)) {
                if (value.texts != std::vector<std::string>{"true"} && value.texts != std::vector<std::string>{"false"})
                    throw CLI::ValidationError("must be true or false");
            } else {
                option.clear();
                for (const std::string& text : value.texts) option.add_result(text);
                if (!value.texts.empty()) option.run_callback();
            }
            values_[key] = std::move(value);
        } catch (const CLI::Error& error) {
            std::string all;
            for (const std::string& text : value.texts) all += (all.empty() ? "" : ", ") + text;
            result_.errors.push_back(value.source + ": " + key + " = " + all + ": " + error.what());
        }
        option.clear();
    }

    void read_environment() {
        for (const auto& [spelling, key] : names_) {
            const std::string name = variable_of(spelling);
            const auto text = variable(environment_, name);
            if (!text || text->empty()) continue;
            Value value{{*text}, name};
            if (takes_many(*options_.at(key))) {
                value.texts = CLI::detail::split(*text, ',');
                std::erase(value.texts, "");
                if (value.texts.empty()) {  // it could not empty the list that the file gave
                    result_.errors.push_back(name + ": " + key + " = " + *text + ": holds no value");
                    continue;
                }
            }
            take(key, std::move(value));
        }
        for (char** entry = environment_; entry != nullptr && *entry != nullptr; ++entry) {
            const std::string_view text = *entry;
            if (!text.starts_with(kPrefix)) continue;
            const std::string name(text.substr(0, text.find('=')));
            const bool known = name == variable_of("config") ||
                               std::any_of(names_.begin(), names_.end(),
                                           [&](const auto& row) { return variable_of(row.first) == name; });
            if (!known) result_.warnings.push_back("the variable " + name + " is none of goniod's options");
        }
    }

    void read_file(const std::string& name) {
        const auto text = read_bounded_file(name, kMaxConfigBytes);
        if (!text) {
            result_.errors.push_back(name + ": the file " + text.error().message);
            return;
        }
        const auto read = toml_read::read({*text, kMaxConfigBytes, "bad_config", "a configuration file"},
                                          [&](const toml::table& table) {
                                              for (const auto& [key, node] : table) read_key(name, key, node);
                                          });
        if (!read) result_.errors.push_back(name + " " + read.error().text());
    }

    void read_key(const std::string& file, const toml::key& key, const toml::node& node) {
        const std::string source = file + " line " + std::to_string(key.source().begin.line);
        const std::string spelling(key.str());
        if (!names_.contains(spelling)) {
            result_.errors.push_back(source + ": " + spelling + " is no option" + nearest(spelling));
            return;
        }
        const std::string& name = names_.at(spelling);
        const CLI::Option& option = *options_.at(name);
        Value value{{}, source};
        std::vector<const toml::node*> nodes{&node};
        if (const toml::array* array = node.as_array(); array != nullptr && takes_many(option)) {
            nodes.clear();
            for (const toml::node& one : *array) nodes.push_back(&one);
        }
        for (const toml::node* one : nodes) {
            const auto text = text_of(option, *one);
            if (!text) {
                const char* kind = is_flag(option) ? "true or false" : is_number(option) ? "a number" : "a string";
                result_.errors.push_back(source + ": " + name + " must be " + kind + ", not " +
                                         toml_read::text_of(*one));
                return;
            }
            value.texts.push_back(*text);
        }
        take(name, std::move(value));
    }
    static std::optional<std::string> text_of(const CLI::Option& option, const toml::node& node) {
        if (is_flag(option)) {
            const auto* value = node.as_boolean();
            return value != nullptr ? std::optional<std::string>(value->get() ? "true" : "false") : std::nullopt;
        }
        if (is_number(option)) {
            if (const auto* whole = node.as_integer()) return std::to_string(whole->get());
            if (const auto* real = node.as_floating_point()) return number_text(real->get());
            return std::nullopt;
        }
        const auto* value = node.as_string();
        return value != nullptr ? std::optional<std::string>(value->get()) : std::nullopt;
    }
    // Result: " (did you mean …?)", or nothing where no name is near.
    std::string nearest(const std::string& name) const {
        std::vector<std::pair<std::size_t, std::string>> near;
        for (const auto& [key, option] : options_) {
            const std::size_t far = key.find(name) != std::string::npos ? 1 : distance(name, key);
            if (far <= std::max<std::size_t>(2, name.size() / 3) && !option->get_group().empty())
                near.emplace_back(far, key);
        }
        std::sort(near.begin(), near.end());
        std::string text;
        for (std::size_t i = 0; i < std::min<std::size_t>(3, near.size()); ++i)
            text += (i == 0 ? " (did you mean " : " or ") + near[i].second;
        return text.empty() ? text : text + "?)";
    }

    CLI::App& app_;
    char** environment_;
    std::map<std::string, CLI::Option*> options_;  // by key
    std::map<std::string, std::string> names_;     // of options, old ones too -> key
    std::map<std::string, Value> values_;
    Settings result_;
};

// Result: the number as TOML has it, where people may write ".5", "60." and "010".
template <typename Number>
std::optional<std::string> parsed_number(const std::string& text) {
    Number number{};
    if (!CLI::detail::lexical_cast(text, number)) return std::nullopt;
    if constexpr (std::is_floating_point_v<Number>)
        return number_text(number);
    else
        return std::to_string(number);
}

std::string value_text(const CLI::Option& option, const std::string& text) {
    if (is_flag(option)) return text == "false" ? "false" : "true";
    if (!is_number(option)) return toml_read::quoted(text);
    const std::string type = option.get_type_name();
    const auto number = type.starts_with("FLOAT")  ? parsed_number<double>(text)
                        : type.starts_with("UINT") ? parsed_number<std::uint64_t>(text)
                                                   : parsed_number<std::int64_t>(text);
    return number.value_or(toml_read::quoted(text));
}

}  // namespace

Settings complete_settings(CLI::App& app, const std::vector<std::string>& arguments, char** environment) {
    return Completion(app, arguments, environment).run();
}

std::string print_settings(const CLI::App& app, const Settings& settings) {
    std::string text = "# The options as they are. What begins with # stands at its default.\n";
    for (const CLI::Option* option : app.get_options()) {
        const std::string key = key_of(*option);
        if (!option->get_configurable() || key.empty()) continue;
        const auto source = settings.sources.find(key);
        const bool given = option->count() > 0 || source != settings.sources.end();
        if (!given && option->get_group().empty()) continue;  // a hook of tests
        std::string value;
        if (takes_many(*option)) {
            const auto shown = [&](const std::string& one) { return value_text(*option, one); };
            value = "[" + CLI::detail::join(option->results(), shown, ", ") + "]";
        } else if (option->count() > 0) {
            value = value_text(*option, option->results().front());
        } else if (is_flag(*option)) {
            value = "false";
        } else {
            value = value_text(*option, option->get_default_str());
        }
        const std::string from = source != settings.sources.end() ? source->second : given ? "command line" : "default";
        text += (given ? "" : "# ") + key + " = " + value + "  # " + from + "\n";
    }
    return text;
}

}  // namespace gonio
