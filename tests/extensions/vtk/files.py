"""VTK files as text."""

POLYDATA = """<?xml version="1.0"?><VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"><PolyData>
<Piece NumberOfPoints="{points}" NumberOfPolys="{polys}"><Points><DataArray type="Float64" NumberOfComponents="3"
format="ascii">{places}</DataArray></Points><Polys><DataArray type="Int64" Name="connectivity" format="ascii">{corners}
</DataArray><DataArray type="Int64" Name="offsets" format="ascii">{offsets}</DataArray></Polys></Piece></PolyData>
</VTKFile>"""
