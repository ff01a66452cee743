-- sinew/sinew_all.h as LuaJIT reads it, with its constants as fields of a table beside the functions.
local ffi = require "ffi"

return function(header_path, library_path)
  local file = assert(io.open(header_path))
  local header = file:read "*a":gsub("//[^\n]*", "")
  file:close()
  local constants = {}
  for name, value in header:gmatch "#define (SINEW_%w[%w_]*) (%d+)%s" do constants[name] = tonumber(value) end
  for name, value in header:gmatch "(SINEW_%w[%w_]*) = (%d+)" do constants[name] = tonumber(value) end
  header = header:gsub("#ifdef __cplusplus.-#endif[^\n]*", ""):gsub("#[^\n]*", "")
  ffi.cdef(header)

  local library = ffi.load(library_path)
  local sinew = {library = library, constants = constants}

  -- sinew.call("world_step", ...): refused, it says why.
  function sinew.call(name, ...)
    local status = library["sinew_" .. name](...)
    if status ~= 0 then
      local why = ffi.new "char[512]"
      library.sinew_last_error(why, 512)
      error(("sinew_%s: %s"):format(name, ffi.string(why)), 2)
    end
  end

  -- A definition with its defaults: sinew.define "body".
  function sinew.define(noun)
    local def = ffi.new("sinew_" .. noun .. "_def")
    sinew.call(noun .. "_def_init", def, ffi.sizeof(def))
    return def
  end

  -- What a create function writes through its last pointer, ended when nobody holds it any longer.
  function sinew.create(name, class, ...)
    local out = ffi.new("sinew_" .. class .. "*[1]")
    local arguments = {...}
    arguments[#arguments + 1] = out
    sinew.call(name, unpack(arguments))
    return ffi.gc(out[0], library["sinew_" .. class .. "_destroy"])
  end

  return sinew
end
