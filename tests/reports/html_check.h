#pragma once
#include <string>
#include <vector>

namespace geocage::reports {

/// The first thing that keeps the page from being well formed, or nothing: tags that close in the order they
/// were opened, attributes in quotes, no bare & or <.
inline std::string html_flaw(const std::string& html) {
  std::vector<std::string> open;
  for (std::size_t i = 0; i < html.size(); ++i) {
    const std::string near = html.substr(i, 60);
    if (html[i] == '&' && html.substr(i, 10).find(';') == std::string::npos) return "bare & at " + near;
    if (html[i] != '<' || html.compare(i, 2, "<!") == 0) continue;
    std::size_t end = i + 1;
    for (bool quoted = false; end < html.size() && (quoted || html[end] != '>'); ++end) {
      if (html[end] == '"') quoted = !quoted;
      if (!quoted && html[end] == '<') return "bare < at " + near;
    }
    if (end == html.size()) return "tag without end at " + near;
    const std::string inside = html.substr(i + 1, end - i - 1);
    const bool closing = inside.starts_with('/');
    const std::string name = inside.substr(closing, inside.find_first_of(" /", closing) - closing);
    if (closing && (open.empty() || open.back() != name))
      return "</" + name + "> closes <" + (open.empty() ? "" : open.back()) + "> at " + near;
    if (closing)
      open.pop_back();
    else if (!inside.ends_with('/') && name != "meta" && name != "img")
      open.push_back(name);
    i = name == "style" && !closing ? html.find("</style>", end) - 1 : end;
  }
  return open.empty() ? "" : "<" + open.back() + "> stays open";
}

}  // namespace geocage::reports
