#include "formats/results/xdmf_internal.h"

namespace gewebe {

XdmfText::XdmfText(const std::string& file) {
  for (const char c : file)
    switch (c) {
    case '&':
      file_ += "&amp;";
      break;
    case '<':
      file_ += "&lt;";
      break;
    case '>':
      file_ += "&gt;";
      break;
    default:
      file_ += c;
    }
}

std::string XdmfText::array(const std::string& path, const std::string& dimensions,
                            const char* type) const {
  return "<DataItem Format=\"HDF\" Dimensions=\"" + dimensions + "\" " + type + ">" + file_ + ":" +
         path + "</DataItem>\n";
}

std::string XdmfText::row(const std::string& path, std::uint64_t row, std::uint64_t count,
                          const std::string& dimensions, int bytes) const {
  const bool two = dimensions.find(' ') != std::string::npos;
  const std::string type = "NumberType=\"Float\" Precision=\"" + std::to_string(bytes) + "\"";
  return "<DataItem ItemType=\"HyperSlab\" Dimensions=\"" + dimensions +
         "\">\n<DataItem Format=\"XML\" Dimensions=\"3 " + (two ? "3" : "2") + "\">" +
         std::to_string(row) + (two ? " 0 0 1 1 1 1 " : " 0 1 1 1 ") + dimensions +
         "</DataItem>\n" + array(path, std::to_string(count) + " " + dimensions, type.c_str()) +
         "</DataItem>\n";
}

std::string XdmfText::attribute(const char* name, const char* type, const char* center,
                                const std::string& row) const {
  return std::string("<Attribute Name=\"") + name + "\" AttributeType=\"" + type + "\" Center=\"" +
         center + "\">\n" + row + "</Attribute>\n";
}

std::string XdmfText::topology(const char* type, const std::string& path, std::uint64_t count,
                               std::uint64_t nodes) const {
  const std::string n = std::to_string(count);
  return std::string("<Topology TopologyType=\"") + type + "\" NumberOfElements=\"" + n + "\">\n" +
         array(path, n + " " + std::to_string(nodes), R"(NumberType="UInt" Precision="4")") +
         "</Topology>\n";
}

} // namespace gewebe
