#pragma once
// Files of VTK in XML, their arrays in any of the ways in which its writers store them.

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {

template <class T>
void put(std::string& bytes, T value, bool swap = false) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (swap)
    std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

struct VtkStyle {
  bool text = false, appended = false, base64 = false, zlib = false, big = false, wide = false;
  std::size_t block = 100;   ///< of zlib, bytes
  bool full_by_name = false; ///< a last block that is full has its size in the header, else 0
};

/// All but text.
inline std::vector<VtkStyle> binary_vtk_styles() {
  std::vector<VtkStyle> styles;
  for (const bool big : {false, true})
    for (const bool wide : {false, true})
      for (const bool zlib : {false, true})
        for (const auto& [appended, coded] :
             {std::pair(false, true), std::pair(true, true), std::pair(true, false)})
          styles.push_back(
              {.appended = appended, .base64 = coded, .zlib = zlib, .big = big, .wide = wide});
  return styles;
}

inline std::string base64(const std::string& bytes) {
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8U | (n + k < bytes.size() ? static_cast<std::uint8_t>(bytes[n + k]) : 0U);
    for (std::uint32_t k = 0; k < 4; ++k)
      text += n + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63U];
  }
  return text;
}

class VtkWriter {
public:
  /// \param type "UnstructuredGrid" \param counts the attributes of its piece
  VtkWriter(const VtkStyle& style, const std::string& type, const std::string& counts)
      : style_(style), type_(type) {
    xml_ = "<?xml version=\"1.0\"?><!-- <Piece> -->\n<VTKFile type='" + type +
           "' version='1.0' byte_order='" + (style_.big ? "BigEndian" : "LittleEndian") + "' " +
           (style_.wide ? "header_type='UInt64' " : "") +
           (style_.zlib ? "compressor='vtkZLibDataCompressor'" : "") + "><" + type +
           ">\n<FieldData><DataArray type='Int32' Name='x' format='ascii'>1</DataArray>"
           "</FieldData><Piece " +
           counts + ">";
  }

  void text(const std::string& xml) { xml_ += xml; }

  template <class T>
  void array(const char* type, const char* name, const std::vector<T>& values, int components = 1) {
    xml_ += std::string("<DataArray type='") + type + "' Name='" + name + "' ";
    if (components > 1)
      xml_ += "NumberOfComponents='" + std::to_string(components) + "'";
    if (style_.text) {
      xml_ += ">\n";
      for (const T value : values)
        xml_ += std::to_string(value) + "\n";
    } else {
      std::string data;
      for (const T value : values)
        put(data, value, style_.big);
      const std::string stored = store(data);
      if (style_.appended) {
        xml_ += "format='appended' offset='" + std::to_string(appended_.size()) + "'>";
        xml_ += "<InformationKey name='L2' location='x'><Value>1</Value></InformationKey>";
        appended_ += stored;
      } else {
        xml_ += "format='binary'>\n<InformationKey name='x'> 1 </InformationKey>\n" + stored + "\n";
      }
    }
    xml_ += "</DataArray>\n";
  }

  std::string end() {
    xml_ += "</Piece></" + type_ + ">\n";
    if (style_.appended)
      xml_ += std::string("<AppendedData encoding='") + (style_.base64 ? "base64" : "raw") +
              "'>\n  _" + appended_ + "\n</AppendedData>\n";
    return xml_ + "</VTKFile>\n";
  }

private:
  void size(std::string& to, std::uint64_t number) const {
    if (style_.wide)
      put(to, number, style_.big);
    else
      put(to, static_cast<std::uint32_t>(number), style_.big);
  }

  std::string store(const std::string& data) const {
    const bool coded = style_.base64 || !style_.appended;
    std::string head, body = data;
    if (!style_.zlib) {
      size(head, data.size());
      return coded ? base64(head + body) : head + body;
    }
    const std::size_t block = style_.block;
    body.clear();
    const std::size_t blocks = (data.size() + block - 1) / block;
    size(head, blocks);
    size(head, block);
    const std::size_t rest = data.size() % block;
    size(head, rest == 0 && style_.full_by_name && !data.empty() ? block : rest);
    for (std::size_t n = 0; n < blocks; ++n) {
      const std::string part = data.substr(n * block, block);
      uLongf packed = compressBound(static_cast<uLong>(part.size()));
      std::string bytes(packed, '\0');
      (void)compress(reinterpret_cast<Bytef*>(bytes.data()), &packed,
                     reinterpret_cast<const Bytef*>(part.data()), static_cast<uLong>(part.size()));
      body.append(bytes, 0, packed);
      size(head, packed);
    }
    return coded ? base64(head) + base64(body) : head + body;
  }

  VtkStyle style_;
  std::string type_, xml_, appended_;
};

} // namespace gewebe::test
